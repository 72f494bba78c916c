-- What is passed on to others (SatNOGS DB, a webhook): one row for each reception and target, written down before it is sent.

create table forwards (
    id bigint primary key check (id > 0),
    -- The same for the same reception and target, in whatever archive: a far end that knows it takes it once.
    message_id text collate "C" not null unique,
    station text collate "C" not null,
    target text collate "C" not null,
    satellite text collate "C" not null,
    frame bigint not null references frames (id) deferrable initially deferred,
    source text collate "C" not null check (source in ('radio', 'own-mqtt')),
    -- The reception, in the table of its source.
    reception bigint not null,
    -- Who heard it, as the target is told.
    receiver text collate "C" not null,
    received_at_us bigint not null,
    made_at_us bigint not null,
    state text collate "C" not null check (state in ('waiting', 'sending', 'sent', 'unknown', 'refused', 'dry')),
    attempts bigint not null,
    sent_at_us bigint,
    -- Why the last attempt failed; no secrets.
    error text collate "C",
    crc bigint not null,
    unique (target, frame, receiver)
);

create index forwards_open on forwards (target, id) where state in ('waiting', 'sending');

create trigger forwards_are_kept before delete on forwards for each row
    execute function refuse('what was passed on is never deleted');

create trigger forwards_are_never_emptied before truncate on forwards
    execute function refuse('forwards: nothing of it is ever deleted');

-- How far the receptions were looked at; one row for each target of a station.
create table forward_targets (
    id bigint primary key check (id > 0),
    station text collate "C" not null,
    target text collate "C" not null,
    radio_through bigint not null,
    outside_through bigint not null,
    paused_by text collate "C",
    paused_at_us bigint,
    crc bigint not null,
    unique (station, target)
);
