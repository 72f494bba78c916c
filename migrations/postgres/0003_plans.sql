-- What is to be done in passes, what came of it, and what commands wait for besides contact.

create table plans (
    id bigint primary key check (id > 0),
    name text collate "C" not null,
    satellite text collate "C" not null,
    station text collate "C" not null,
    -- The plan as it was handed over, as JSON.
    plan text collate "C" not null,
    added_at_us bigint not null,
    who text collate "C" not null,
    armed bigint not null check (armed in (0, 1)),
    -- Instants within passes that an operator chose, microseconds since 1970 UTC, as a JSON array.
    picks text collate "C" not null,
    withdrawn_at_us bigint,
    crc bigint not null
);

create index plans_in_use on plans (name) where withdrawn_at_us is null;

create trigger plans_are_kept before delete on plans for each row
    execute function refuse('a plan is never deleted: runs point at it');

create trigger plans_keep_their_text before update on plans for each row
    when (new.name <> old.name or new.satellite <> old.satellite or new.station <> old.station or new.plan <> old.plan or new.added_at_us <> old.added_at_us or new.who <> old.who)
    execute function refuse('the text of a plan is never changed: hand a new one over');

create table plan_runs (
    id bigint primary key check (id > 0),
    plan bigint not null references plans (id) deferrable initially deferred,
    satellite text collate "C" not null,
    station text collate "C" not null,
    link text collate "C",
    pass bigint references passes (id) deferrable initially deferred,
    aos_at_us bigint not null,
    los_at_us bigint not null,
    state text collate "C" not null check (state in ('planned', 'waiting', 'running', 'held', 'ended', 'missed', 'dropped')),
    why text collate "C",
    -- How far it has come, as JSON; `outcome` tells how it ended.
    progress text collate "C" not null,
    outcome text collate "C",
    at_us bigint not null,
    crc bigint not null
);

-- What was heard in a pass is counted for its report.
create index frames_by_time on frames (satellite, station, heard_at_us);
create index chunks_by_frame on chunks (frame);

create index plan_runs_by_time on plan_runs (satellite, aos_at_us);
create index plan_runs_open on plan_runs (id) where state in ('planned', 'waiting', 'running', 'held');

create trigger plan_runs_are_kept before delete on plan_runs for each row
    execute function refuse('a run is never deleted');

-- Beside commands, whose rows and checksums stay as they were made.
create table command_conditions (
    command bigint primary key references commands (id) deferrable initially deferred,
    condition text collate "C" not null,
    crc bigint not null
);

create trigger command_conditions_are_kept before delete on command_conditions for each row
    execute function refuse('a condition of a command is never deleted');

create trigger command_conditions_are_never_changed before update on command_conditions for each row
    execute function refuse('a condition of a command is never changed');

create trigger plans_are_never_emptied before truncate on plans
    execute function refuse('plans: nothing of it is ever deleted');
create trigger plan_runs_are_never_emptied before truncate on plan_runs
    execute function refuse('plan_runs: nothing of it is ever deleted');
create trigger command_conditions_are_never_emptied before truncate on command_conditions
    execute function refuse('command_conditions: nothing of it is ever deleted');
