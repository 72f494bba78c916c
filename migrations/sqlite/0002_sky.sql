-- Where satellites are: their elements, and the passes over the station with the elements they were computed from.

create table elements (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    norad_cat_id integer,
    object_name text,
    epoch_us integer not null,
    source text not null,
    added_at_us integer not null,
    who text not null,
    -- The whole set as one OMM in JSON: nothing of its message is lost.
    omm text not null,
    crc integer not null
) strict;

create index elements_by_epoch on elements (satellite, epoch_us, id);

create trigger elements_are_kept before delete on elements
begin
    select raise(abort, 'elements are never deleted: a pass may have used them');
end;

create trigger elements_are_never_changed before update on elements
begin
    select raise(abort, 'elements are never changed: add newer ones');
end;

create table passes (
    id integer primary key check (id > 0),
    satellite text not null,
    station text not null,
    aos_at_us integer not null,
    tca_at_us integer not null,
    los_at_us integer,
    max_elevation_deg real not null,
    ended_at_us integer,
    crc integer not null
) strict;

create index passes_by_time on passes (satellite, aos_at_us);
create index passes_not_ended on passes (satellite, id) where ended_at_us is null;

create trigger passes_are_kept before delete on passes
begin
    select raise(abort, 'a pass is never deleted');
end;

-- What the antenna and the uplink went by, and since when.
create table pass_elements (
    id integer primary key,
    pass integer not null references passes (id) deferrable initially deferred,
    elements integer not null references elements (id) deferrable initially deferred,
    from_us integer not null,
    crc integer not null,
    unique (pass, elements, from_us)
) strict;

create trigger pass_elements_are_kept before delete on pass_elements
begin
    select raise(abort, 'what a pass used is never forgotten');
end;

create trigger pass_elements_are_never_changed before update on pass_elements
begin
    select raise(abort, 'what a pass used is never changed');
end;
