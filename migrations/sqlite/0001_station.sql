-- The station's memory. docs/storage.md says what each table is for and why it looks as it does.
--
-- Times are microseconds since 1970 UTC. Names of satellites, stations and links are those of the configuration,
-- keys are their ids (8 hex digits), never the keys. The last column of a row, crc, is the CRC-32 of the others:
-- SQLite notices a page that is no page, but not a digit that has changed inside a value.
--
-- References are checked at the commit, so that the records of a batch may stand in any order.

create table meta (
    id integer primary key check (id = 1),
    station text not null,
    simulated integer not null check (simulated in (0, 1)),
    created_at_us integer not null,
    schema_crc integer not null,
    crc integer not null
) strict;

-- What was heard, for ever.

create table frames (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    link text not null,
    bytes blob not null check (length(bytes) between 16 and 240),
    form text not null check (form in ('full', 'short')),
    packet_type integer check (packet_type between 0 and 255),
    tag integer check (tag between 1 and 255),
    nested integer not null check (nested in (0, 1)),
    heard_at_us integer not null,
    crc integer not null
) strict;

create index frames_by_type on frames (satellite, packet_type, id);

create trigger frames_are_kept before delete on frames
begin
    select raise(abort, 'a raw frame is never deleted');
end;

-- Only `nested` may change: what lay inside a candidate that turned out to be no frame counts after all.
create trigger frames_are_never_changed
before update of id, satellite, station, link, bytes, form, packet_type, tag, heard_at_us on frames
begin
    select raise(abort, 'a raw frame is never changed');
end;

create table receptions (
    id integer primary key,
    frame integer not null references frames (id) deferrable initially deferred,
    satellite text not null,
    station text not null,
    link text not null,
    source text not null check (source in ('radio', 'file')),
    received_at_us integer not null,
    rssi_dbm integer,
    crc integer not null
) strict;

create index receptions_by_frame on receptions (frame);

create trigger receptions_are_kept before delete on receptions
begin
    select raise(abort, 'a reception is never deleted');
end;

-- What was derived from it; `gs-server redecode` makes these rows again.

create table parameters (
    id integer primary key check (id > 0),
    satellite text not null,
    name text not null,
    unit text not null,
    crc integer not null,
    unique (satellite, name)
) strict;

-- Each satellite, station and link that values came from and over: a small number stands in each of a million rows.
create table routes (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    link text not null,
    crc integer not null,
    unique (satellite, station, link)
) strict;

create trigger routes_are_kept before delete on routes
begin
    select raise(abort, 'a route is never deleted: values point at it');
end;

create trigger routes_are_never_changed before update on routes
begin
    select raise(abort, 'a route is never changed: values point at it');
end;

-- Clustered by parameter and time: a range of one parameter is one sweep over neighbouring pages.
create table telemetry (
    parameter integer not null references parameters (id) deferrable initially deferred,
    at_us integer not null,
    frame integer not null references frames (id) deferrable initially deferred,
    route integer not null references routes (id) deferrable initially deferred,
    value real,
    decoder_version integer not null,
    crc integer not null,
    primary key (parameter, at_us, frame)
) strict, without rowid;

-- How far `gs-server redecode` has come, while it is not finished.
create table redecode (
    decoder_version integer primary key,
    last_frame integer not null
) strict;

-- What was to be said.

create table commands (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    link text not null,
    key text not null check (length(key) = 8),
    principal text not null,
    download integer references downloads (id) deferrable initially deferred,
    packet_type integer not null check (packet_type between 0 and 255),
    payload blob not null check (length(payload) <= 196),
    name text not null,
    priority integer not null,
    gate text not null check (gate in ('heard', 'blind')),
    attempts_allowed integer not null,
    created_at_us integer not null,
    expires_at_us integer,
    crc integer not null
) strict;

create trigger commands_are_kept before delete on commands
begin
    select raise(abort, 'a command is never deleted');
end;

create trigger commands_are_never_changed before update on commands
begin
    select raise(abort, 'a command is never changed: its life is in command_stages');
end;

create table command_stages (
    id integer primary key,
    command integer not null references commands (id) deferrable initially deferred,
    satellite text not null,
    station text not null,
    link text not null,
    key text not null check (length(key) = 8),
    attempt integer not null,
    stage text not null check (stage in ('queued', 'sealed', 'radiating', 'radiated', 'answered', 'failed',
        'rejected', 'expired', 'cancelled', 'unknown')),
    at_us integer not null,
    who text not null,
    why text not null,
    frame integer references frames (id) deferrable initially deferred,
    crc integer not null
) strict;

create index command_stages_by_command on command_stages (command, id);

create trigger command_stages_are_kept before delete on command_stages
begin
    select raise(abort, 'a stage of a command is never deleted');
end;

create trigger command_stages_are_never_changed before update on command_stages
begin
    select raise(abort, 'a stage of a command is never changed: append the next one');
end;

create table sealed_frames (
    id integer primary key,
    key text not null check (length(key) = 8),
    counter integer not null check (counter >= 0),
    nonce blob not null check (length(nonce) = 12),
    command integer not null references commands (id) deferrable initially deferred,
    attempt integer not null,
    tag integer not null check (tag between 1 and 255),
    satellite text not null,
    station text not null,
    link text not null,
    bytes blob not null check (length(bytes) = 240),
    sealed_at_us integer not null,
    crc integer not null,
    unique (key, nonce),
    unique (key, counter)
) strict;

create index sealed_frames_by_command on sealed_frames (command, id);
create index sealed_frames_by_satellite on sealed_frames (satellite, id);

create trigger sealed_frames_are_kept before delete on sealed_frames
begin
    select raise(abort, 'a sealed frame is never deleted: its nonce is spent');
end;

create trigger sealed_frames_are_never_changed before update on sealed_frames
begin
    select raise(abort, 'a sealed frame is never changed: its nonce is spent');
end;

create table counter_floors (
    id integer primary key,
    station text not null,
    key text not null check (length(key) = 8),
    counter integer not null check (counter >= 0),
    at_us integer not null,
    who text not null,
    crc integer not null
) strict;

create index counter_floors_by_key on counter_floors (key, counter);

create trigger counter_floors_are_kept before delete on counter_floors
begin
    select raise(abort, 'a floor of a counter is never deleted');
end;

create trigger counter_floors_are_never_changed before update on counter_floors
begin
    select raise(abort, 'a floor of a counter is never changed: append a higher one');
end;

-- Images.

create table images (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    link text not null,
    declared_by integer not null references frames (id) deferrable initially deferred,
    declared_at_us integer not null,
    size_bytes integer not null,
    chunks integer not null,
    width_px integer not null,
    height_px integer not null,
    held integer not null,
    conflicts integer not null,
    completed_at_us integer,
    sha256 blob check (length(sha256) = 32),
    crc integer not null
) strict;

create index images_by_satellite on images (satellite, id);

create table chunks (
    id integer primary key,
    image integer not null references images (id) deferrable initially deferred,
    chunk_index integer not null check (chunk_index between 0 and 65535),
    frame integer not null references frames (id) deferrable initially deferred,
    satellite text not null,
    station text not null,
    link text not null,
    at_us integer not null,
    conflict integer not null check (conflict in (0, 1)),
    data blob not null check (length(data) = 222),
    crc integer not null
) strict;

create unique index chunks_held on chunks (image, chunk_index) where conflict = 0;
create index chunks_by_image on chunks (image, chunk_index, id);

create trigger chunks_are_kept before delete on chunks
begin
    select raise(abort, 'a chunk is never deleted');
end;

create trigger chunks_are_never_changed before update on chunks
begin
    select raise(abort, 'a chunk is never changed: another version is kept beside it');
end;

create table downloads (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    link text not null,
    image integer references images (id) deferrable initially deferred,
    principal text not null,
    state text not null check (state in ('active', 'complete', 'cancelled', 'failed')),
    created_at_us integer not null,
    requests integer not null,
    chunks_requested integer not null,
    chunks_bridged integer not null,
    crc integer not null
) strict;

create index downloads_active on downloads (satellite, id) where state = 'active';

-- What to know.

create table limits (
    satellite text not null,
    parameter text not null,
    station text not null,
    level text not null,
    since_us integer not null,
    value real,
    crc integer not null,
    primary key (satellite, parameter)
) strict;

-- The one durable sequence: a number is given at the commit, and never again.
create table events (
    seq integer primary key autoincrement,
    at_us integer not null,
    kind text not null,
    level text not null,
    satellite text,
    station text not null,
    link text,
    key text,
    frame integer,
    command integer,
    image integer,
    download integer,
    message text not null,
    crc integer not null
) strict;

create trigger events_are_kept before delete on events
begin
    select raise(abort, 'an event is never deleted');
end;

create trigger events_are_never_changed before update on events
begin
    select raise(abort, 'an event is never changed');
end;

create table audit (
    id integer primary key,
    station text not null,
    at_us integer not null,
    who text not null,
    action text not null,
    detail text not null,
    crc integer not null
) strict;

create trigger audit_is_kept before delete on audit
begin
    select raise(abort, 'the audit is never shortened');
end;

create trigger audit_is_never_changed before update on audit
begin
    select raise(abort, 'the audit is never changed');
end;

create table intents (
    principal text not null,
    idempotency_key text not null,
    station text not null,
    digest blob not null check (length(digest) = 32),
    accepted text not null check (accepted in ('command', 'cancelled', 'download', 'download-cancelled', 'done')),
    subject integer,
    at_us integer not null,
    crc integer not null,
    primary key (principal, idempotency_key)
) strict;

create trigger intents_are_kept before delete on intents
begin
    select raise(abort, 'an accepted intent is never deleted');
end;

create trigger intents_are_never_changed before update on intents
begin
    select raise(abort, 'an accepted intent is never changed');
end;
