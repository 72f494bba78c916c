-- Who may do what: users, their sessions, the tokens of machines; what a second person has to approve; and who answered
-- for each transmission.
--
-- No secret is in here: of tokens and one-time codes the SHA-256, of passwords what Argon2id made of them.

create table users (
    name text collate "C" primary key check (length(name) between 1 and 32),
    role text collate "C" not null check (role in ('viewer', 'operator', 'mission-lead', 'administrator')),
    -- As a PHC string; none until the one-time link was used.
    password text collate "C",
    password_at_us bigint,
    call_sign text collate "C" not null,
    licence text collate "C" not null,
    disabled bigint not null check (disabled in (0, 1)),
    created_at_us bigint not null,
    created_by text collate "C" not null,
    crc bigint not null
);

create trigger users_are_kept before delete on users for each row
    execute function refuse('a user is never deleted: records name them. Disable the user');

-- One-time links. One without a name makes the first administrator.
create table user_links (
    code_hash bytea primary key check (length(code_hash) = 32),
    user_name text collate "C" references users (name) deferrable initially deferred,
    made_by text collate "C" not null,
    created_at_us bigint not null,
    expires_at_us bigint not null,
    used_at_us bigint,
    crc bigint not null
);

create index user_links_by_user on user_links (user_name);

create table sessions (
    id text collate "C" primary key,
    user_name text collate "C" not null references users (name) deferrable initially deferred,
    token_hash bytea not null unique check (length(token_hash) = 32),
    -- The token before the last exchange, good until the new one is used and a little after.
    previous_hash bytea check (length(previous_hash) = 32),
    previous_until_us bigint,
    created_at_us bigint not null,
    rotated_at_us bigint not null,
    seen_at_us bigint not null,
    ended_at_us bigint,
    ended_why text collate "C",
    crc bigint not null
);

create index sessions_by_previous on sessions (previous_hash) where previous_hash is not null;
create index sessions_by_user on sessions (user_name) where ended_at_us is null;

create table tokens (
    name text collate "C" primary key check (length(name) between 1 and 32),
    token_hash bytea not null unique check (length(token_hash) = 32),
    -- The person who answers for it.
    owner text collate "C" references users (name) deferrable initially deferred,
    -- Rights, with blanks between.
    scopes text collate "C" not null,
    created_at_us bigint not null,
    created_by text collate "C" not null,
    expires_at_us bigint not null,
    revoked_at_us bigint,
    crc bigint not null
);

create trigger tokens_are_kept before delete on tokens for each row
    execute function refuse('a token is never deleted: records name it. Revoke it');

create table approvals (
    id bigint primary key check (id > 0),
    kind text collate "C" not null check (kind in ('command', 'arm-plan')),
    -- What was asked for, as JSON, and the SHA-256 of what it means: what is approved is what is released.
    request text collate "C" not null,
    digest bytea not null check (length(digest) = 32),
    summary text collate "C" not null,
    principal text collate "C" not null,
    person text collate "C" not null,
    idempotency_key text collate "C" not null,
    request_digest bytea not null check (length(request_digest) = 32),
    asked_at_us bigint not null,
    expires_at_us bigint not null,
    state text collate "C" not null check (state in ('awaiting', 'approved', 'refused')),
    decided_by text collate "C",
    decided_at_us bigint,
    why text collate "C",
    -- What became of it, once it was released.
    command bigint,
    released_at_us bigint,
    crc bigint not null,
    unique (principal, idempotency_key)
);

create index approvals_awaiting on approvals (id) where state = 'awaiting';

create trigger approvals_are_kept before delete on approvals for each row
    execute function refuse('what was asked for is never deleted');

create trigger approvals_keep_what_was_asked before update on approvals for each row
    when (new.kind <> old.kind or new.request <> old.request or new.digest <> old.digest or new.principal <> old.principal or new.person <> old.person or new.idempotency_key <> old.idempotency_key or new.request_digest <> old.request_digest or new.expires_at_us <> old.expires_at_us)
    execute function refuse('what was asked for is never changed: ask anew');

-- Whose call sign stands for the station when nobody with one asked.
create table station_licences (
    station text collate "C" primary key,
    call_sign text collate "C" not null,
    licence text collate "C" not null,
    crc bigint not null
);

-- Who answered for each radiation: written with the permission to radiate.
create table transmissions (
    command bigint not null references commands (id) deferrable initially deferred,
    attempt bigint not null,
    satellite text collate "C" not null,
    station text collate "C" not null,
    link text collate "C" not null,
    at_us bigint not null,
    -- Who asked for the command, as the command says it; and the person behind it.
    principal text collate "C" not null,
    person text collate "C",
    call_sign text collate "C",
    licence text collate "C",
    crc bigint not null,
    primary key (command, attempt)
);

create trigger transmissions_are_kept before delete on transmissions for each row
    execute function refuse('the record of a transmission is never deleted');

create trigger transmissions_are_never_changed before update on transmissions for each row
    execute function refuse('the record of a transmission is never changed');

create trigger users_are_never_emptied before truncate on users
    execute function refuse('users: nothing of it is ever deleted');
create trigger tokens_are_never_emptied before truncate on tokens
    execute function refuse('tokens: nothing of it is ever deleted');
create trigger approvals_are_never_emptied before truncate on approvals
    execute function refuse('approvals: nothing of it is ever deleted');
create trigger transmissions_are_never_emptied before truncate on transmissions
    execute function refuse('transmissions: nothing of it is ever deleted');
