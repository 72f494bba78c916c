-- What is passed on to others (SatNOGS DB, a webhook): one row for each reception and target, written down before it is sent.

create table forwards (
    id integer primary key check (id > 0),
    -- The same for the same reception and target, in whatever archive: a far end that knows it takes it once.
    message_id text not null unique,
    station text not null,
    target text not null,
    satellite text not null,
    frame integer not null references frames (id) deferrable initially deferred,
    source text not null check (source in ('radio', 'own-mqtt')),
    -- The reception, in the table of its source.
    reception integer not null,
    -- Who heard it, as the target is told.
    receiver text not null,
    received_at_us integer not null,
    made_at_us integer not null,
    state text not null check (state in ('waiting', 'sending', 'sent', 'unknown', 'refused', 'dry')),
    attempts integer not null,
    sent_at_us integer,
    -- Why the last attempt failed; no secrets.
    error text,
    crc integer not null,
    unique (target, frame, receiver)
) strict;

create index forwards_open on forwards (target, id) where state in ('waiting', 'sending');

create trigger forwards_are_kept before delete on forwards
begin
    select raise(abort, 'what was passed on is never deleted');
end;

-- How far the receptions were looked at; one row for each target of a station.
create table forward_targets (
    id integer primary key check (id > 0),
    station text not null,
    target text not null,
    radio_through integer not null,
    outside_through integer not null,
    paused_by text,
    paused_at_us integer,
    crc integer not null,
    unique (station, target)
) strict;
