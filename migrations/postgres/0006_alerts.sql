-- What should not be, who knows of it, and who is told.

create table alerts (
    id bigint primary key check (id > 0),
    station text collate "C" not null,
    rule text collate "C" not null,
    kind text collate "C" not null,
    subject text collate "C" not null,
    satellite text collate "C",
    level text collate "C" not null,
    worst text collate "C" not null,
    active bigint not null check (active in (0, 1)),
    message text collate "C" not null,
    times bigint not null,
    raised_at_us bigint not null,
    changed_at_us bigint not null,
    waiting_since_us bigint not null,
    returned_at_us bigint,
    acknowledged_by text collate "C",
    acknowledged_at_us bigint,
    shelved_by text collate "C",
    shelved_until_us bigint,
    assignee text collate "C",
    note text collate "C",
    closed_at_us bigint,
    -- What its targets were told last.
    told_active bigint check (told_active in (0, 1)),
    told_level text collate "C",
    told_times bigint,
    told_at_us bigint,
    escalated bigint not null,
    crc bigint not null
);

create index alerts_open on alerts (id) where closed_at_us is null;

create trigger alerts_are_kept before delete on alerts for each row
    execute function refuse('an alert is never deleted: it closes');

-- Messages on their way out. Each is written down before it is sent, and carries its number to the far end.
create table alert_deliveries (
    id bigint primary key check (id > 0),
    message_id text collate "C" not null unique,
    station text collate "C" not null,
    alert bigint references alerts (id) deferrable initially deferred,
    target text collate "C" not null,
    what text collate "C" not null,
    level text collate "C" not null,
    title text collate "C" not null,
    body text collate "C" not null,
    made_at_us bigint not null,
    state text collate "C" not null check (state in ('held', 'waiting', 'sent', 'given-up', 'in-digest')),
    attempts bigint not null,
    next_at_us bigint not null,
    sent_at_us bigint,
    -- Why the last attempt failed; no secrets.
    error text collate "C",
    -- The digest that told it.
    digest bigint,
    crc bigint not null
);

create index alert_deliveries_open on alert_deliveries (target, next_at_us) where state in ('held', 'waiting');
create index alert_deliveries_by_alert on alert_deliveries (alert);

-- How far events and runs were looked at; one row for each station.
create table alert_progress (
    id bigint primary key check (id > 0),
    events_through bigint not null,
    runs_through_us bigint not null,
    crc bigint not null
);
