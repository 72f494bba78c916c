-- What should not be, who knows of it, and who is told.

create table alerts (
    id integer primary key check (id > 0),
    station text not null,
    rule text not null,
    kind text not null,
    subject text not null,
    satellite text,
    level text not null,
    worst text not null,
    active integer not null check (active in (0, 1)),
    message text not null,
    times integer not null,
    raised_at_us integer not null,
    changed_at_us integer not null,
    waiting_since_us integer not null,
    returned_at_us integer,
    acknowledged_by text,
    acknowledged_at_us integer,
    shelved_by text,
    shelved_until_us integer,
    assignee text,
    note text,
    closed_at_us integer,
    -- What its targets were told last.
    told_active integer check (told_active in (0, 1)),
    told_level text,
    told_times integer,
    told_at_us integer,
    escalated integer not null,
    crc integer not null
) strict;

create index alerts_open on alerts (id) where closed_at_us is null;

create trigger alerts_are_kept before delete on alerts
begin
    select raise(abort, 'an alert is never deleted: it closes');
end;

-- Messages on their way out. Each is written down before it is sent, and carries its number to the far end.
create table alert_deliveries (
    id integer primary key check (id > 0),
    message_id text not null unique,
    station text not null,
    alert integer references alerts (id) deferrable initially deferred,
    target text not null,
    what text not null,
    level text not null,
    title text not null,
    body text not null,
    made_at_us integer not null,
    state text not null check (state in ('held', 'waiting', 'sent', 'given-up', 'in-digest')),
    attempts integer not null,
    next_at_us integer not null,
    sent_at_us integer,
    -- Why the last attempt failed; no secrets.
    error text,
    -- The digest that told it.
    digest integer,
    crc integer not null
) strict;

create index alert_deliveries_open on alert_deliveries (target, next_at_us) where state in ('held', 'waiting');
create index alert_deliveries_by_alert on alert_deliveries (alert);

-- How far events and runs were looked at; one row for each station.
create table alert_progress (
    id integer primary key check (id > 0),
    events_through integer not null,
    runs_through_us integer not null,
    crc integer not null
) strict;
