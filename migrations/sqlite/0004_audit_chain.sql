-- Each row of the audit is tied to the one before it: hash = SHA-256 over the hash before and all columns of the row.
-- Whoever changes, drops or reorders rows breaks the chain; `gs-server audit verify` looks. Rows from before this step
-- are tied at the first opening.

create table audit_links (
    audit integer primary key references audit (id) deferrable initially deferred,
    hash blob not null check (length(hash) = 32),
    crc integer not null
) strict;

create trigger audit_links_are_kept before delete on audit_links
begin
    select raise(abort, 'the audit is never shortened');
end;

create trigger audit_links_are_never_changed before update on audit_links
begin
    select raise(abort, 'the audit is never changed');
end;
