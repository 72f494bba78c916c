-- What ears other than our radio heard: reports of TinyGS, SatNOGS and files. Anyone can make one up, so they stand beside
-- `receptions`, which hold what our own links heard.

create table outside_receptions (
    id integer primary key,
    satellite text not null,
    station text not null,
    -- The frame; null for what is none: a packet of which the receiver kept nothing, or damaged bytes.
    frame integer references frames (id) deferrable initially deferred,
    kind text not null check (kind in ('frame', 'repairable', 'damaged', 'detection')),
    source text not null check (source in ('own-mqtt', 'tinygs-api', 'satnogs', 'console', 'file')),
    -- With source and receiver what tells a report from all others: it is stored once, however often it comes.
    source_id text not null,
    -- The receiver's id; empty when nobody said who it was.
    receiver text not null,
    receiver_name text,
    latitude_deg real,
    longitude_deg real,
    altitude_m real,
    received_at_us integer not null,
    -- How the time is known, and how far off it may be; null when nobody can tell.
    time_basis text not null,
    time_error_us integer,
    frequency_hz real,
    frequency_offset_hz real,
    doppler_hz real,
    frequency_error_hz real,
    spreading_factor integer,
    bandwidth_hz real,
    coding_rate integer,
    rssi_dbm real,
    snr_db real,
    radio_crc text not null,
    noisy integer not null check (noisy in (0, 1)),
    label text,
    norad integer,
    -- What stood before the frame in what was delivered.
    trim_bytes integer not null,
    trim_bits integer not null,
    -- The bit that, flipped, would make a frame of damaged bytes: an offer, never proof.
    repaired_bit integer,
    -- What was not believed of the report, with blanks between.
    doubts text not null,
    -- The report as it came. Null when the first reception of the same report has it.
    original blob,
    taken_at_us integer not null,
    crc integer not null,
    unique (source, source_id, receiver)
) strict;

create index outside_receptions_by_frame on outside_receptions (frame) where frame is not null;
create index outside_receptions_by_time on outside_receptions (received_at_us);
-- The same bytes are found by the checksum that stands in them.
create index frames_by_checksum on frames (substr(bytes, 9, 4));

create trigger outside_receptions_are_kept before delete on outside_receptions
begin
    select raise(abort, 'a reception is never deleted');
end;

create trigger outside_receptions_are_never_changed before update on outside_receptions
begin
    select raise(abort, 'a reception is never changed');
end;
