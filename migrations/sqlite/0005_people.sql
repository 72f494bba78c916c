-- Who may do what: users, their sessions, the tokens of machines; what a second person has to approve; and who answered
-- for each transmission.
--
-- No secret is in here: of tokens and one-time codes the SHA-256, of passwords what Argon2id made of them.

create table users (
    name text primary key check (length(name) between 1 and 32),
    role text not null check (role in ('viewer', 'operator', 'mission-lead', 'administrator')),
    -- As a PHC string; none until the one-time link was used.
    password text,
    password_at_us integer,
    call_sign text not null,
    licence text not null,
    disabled integer not null check (disabled in (0, 1)),
    created_at_us integer not null,
    created_by text not null,
    crc integer not null
) strict;

create trigger users_are_kept before delete on users
begin
    select raise(abort, 'a user is never deleted: records name them. Disable the user');
end;

-- One-time links. One without a name makes the first administrator.
create table user_links (
    code_hash blob primary key check (length(code_hash) = 32),
    user_name text references users (name) deferrable initially deferred,
    made_by text not null,
    created_at_us integer not null,
    expires_at_us integer not null,
    used_at_us integer,
    crc integer not null
) strict;

create index user_links_by_user on user_links (user_name);

create table sessions (
    id text primary key,
    user_name text not null references users (name) deferrable initially deferred,
    token_hash blob not null unique check (length(token_hash) = 32),
    -- The token before the last exchange, good until the new one is used and a little after.
    previous_hash blob check (length(previous_hash) = 32),
    previous_until_us integer,
    created_at_us integer not null,
    rotated_at_us integer not null,
    seen_at_us integer not null,
    ended_at_us integer,
    ended_why text,
    crc integer not null
) strict;

create index sessions_by_previous on sessions (previous_hash) where previous_hash is not null;
create index sessions_by_user on sessions (user_name) where ended_at_us is null;

create table tokens (
    name text primary key check (length(name) between 1 and 32),
    token_hash blob not null unique check (length(token_hash) = 32),
    -- The person who answers for it.
    owner text references users (name) deferrable initially deferred,
    -- Rights, with blanks between.
    scopes text not null,
    created_at_us integer not null,
    created_by text not null,
    expires_at_us integer not null,
    revoked_at_us integer,
    crc integer not null
) strict;

create trigger tokens_are_kept before delete on tokens
begin
    select raise(abort, 'a token is never deleted: records name it. Revoke it');
end;

create table approvals (
    id integer primary key check (id > 0),
    kind text not null check (kind in ('command', 'arm-plan')),
    -- What was asked for, as JSON, and the SHA-256 of what it means: what is approved is what is released.
    request text not null,
    digest blob not null check (length(digest) = 32),
    summary text not null,
    principal text not null,
    person text not null,
    idempotency_key text not null,
    request_digest blob not null check (length(request_digest) = 32),
    asked_at_us integer not null,
    expires_at_us integer not null,
    state text not null check (state in ('awaiting', 'approved', 'refused')),
    decided_by text,
    decided_at_us integer,
    why text,
    -- What became of it, once it was released.
    command integer,
    released_at_us integer,
    crc integer not null,
    unique (principal, idempotency_key)
) strict;

create index approvals_awaiting on approvals (id) where state = 'awaiting';

create trigger approvals_are_kept before delete on approvals
begin
    select raise(abort, 'what was asked for is never deleted');
end;

create trigger approvals_keep_what_was_asked before update on approvals
when new.kind <> old.kind or new.request <> old.request or new.digest <> old.digest or new.principal <> old.principal
    or new.person <> old.person or new.idempotency_key <> old.idempotency_key
    or new.request_digest <> old.request_digest or new.expires_at_us <> old.expires_at_us
begin
    select raise(abort, 'what was asked for is never changed: ask anew');
end;

-- Whose call sign stands for the station when nobody with one asked.
create table station_licences (
    station text primary key,
    call_sign text not null,
    licence text not null,
    crc integer not null
) strict;

-- Who answered for each radiation: written with the permission to radiate.
create table transmissions (
    command integer not null references commands (id) deferrable initially deferred,
    attempt integer not null,
    satellite text not null,
    station text not null,
    link text not null,
    at_us integer not null,
    -- Who asked for the command, as the command says it; and the person behind it.
    principal text not null,
    person text,
    call_sign text,
    licence text,
    crc integer not null,
    primary key (command, attempt)
) strict;

create trigger transmissions_are_kept before delete on transmissions
begin
    select raise(abort, 'the record of a transmission is never deleted');
end;

create trigger transmissions_are_never_changed before update on transmissions
begin
    select raise(abort, 'the record of a transmission is never changed');
end;
