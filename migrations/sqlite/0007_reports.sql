-- What happened in a pass or a month is found by its time.

create index events_by_time on events (at_us, seq);
create index command_stages_by_time on command_stages (satellite, at_us);
