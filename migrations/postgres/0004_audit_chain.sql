-- Each row of the audit is tied to the one before it: hash = SHA-256 over the hash before and all columns of the row.
-- Whoever changes, drops or reorders rows breaks the chain. Rows from before this step are tied at the first opening.

create table audit_links (
    audit bigint primary key references audit (id) deferrable initially deferred,
    hash bytea not null check (length(hash) = 32),
    crc bigint not null
);

create trigger audit_links_are_kept before delete on audit_links for each row
    execute function refuse('the audit is never shortened');

create trigger audit_links_are_never_changed before update on audit_links for each row
    execute function refuse('the audit is never changed');

create trigger audit_links_are_never_emptied before truncate on audit_links
    execute function refuse('audit_links: nothing of it is ever deleted');
