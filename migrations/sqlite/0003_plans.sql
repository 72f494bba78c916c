-- What is to be done in passes, what came of it, and what commands wait for besides contact.

create table plans (
    id integer primary key check (id > 0),
    name text not null,
    satellite text not null,
    station text not null,
    -- The plan as it was handed over, as JSON.
    plan text not null,
    added_at_us integer not null,
    who text not null,
    armed integer not null check (armed in (0, 1)),
    -- Instants within passes that an operator chose, microseconds since 1970 UTC, as a JSON array.
    picks text not null,
    withdrawn_at_us integer,
    crc integer not null
) strict;

create index plans_in_use on plans (name) where withdrawn_at_us is null;

create trigger plans_are_kept before delete on plans
begin
    select raise(abort, 'a plan is never deleted: runs point at it');
end;

create trigger plans_keep_their_text before update on plans
when new.name <> old.name or new.satellite <> old.satellite or new.station <> old.station
    or new.plan <> old.plan or new.added_at_us <> old.added_at_us or new.who <> old.who
begin
    select raise(abort, 'the text of a plan is never changed: hand a new one over');
end;

create table plan_runs (
    id integer primary key check (id > 0),
    plan integer not null references plans (id) deferrable initially deferred,
    satellite text not null,
    station text not null,
    link text,
    pass integer references passes (id) deferrable initially deferred,
    aos_at_us integer not null,
    los_at_us integer not null,
    state text not null check (state in ('planned', 'waiting', 'running', 'held', 'ended', 'missed', 'dropped')),
    why text,
    -- How far it has come, as JSON; `outcome` tells how it ended.
    progress text not null,
    outcome text,
    at_us integer not null,
    crc integer not null
) strict;

-- What was heard in a pass is counted for its report.
create index frames_by_time on frames (satellite, station, heard_at_us);
create index chunks_by_frame on chunks (frame);

create index plan_runs_by_time on plan_runs (satellite, aos_at_us);
create index plan_runs_open on plan_runs (id) where state in ('planned', 'waiting', 'running', 'held');

create trigger plan_runs_are_kept before delete on plan_runs
begin
    select raise(abort, 'a run is never deleted');
end;

-- Beside commands, whose rows and checksums stay as they were made.
create table command_conditions (
    command integer primary key references commands (id) deferrable initially deferred,
    condition text not null,
    crc integer not null
) strict;

create trigger command_conditions_are_kept before delete on command_conditions
begin
    select raise(abort, 'a condition of a command is never deleted');
end;

create trigger command_conditions_are_never_changed before update on command_conditions
begin
    select raise(abort, 'a condition of a command is never changed');
end;
