//! The PostgreSQL of the configuration: is it there, does it keep what it acknowledges, and is it the right one.

use super::{Finding, with_reasons};
use crate::clock::SystemClock;
use crate::config::Config;
use crate::run;
use crate::storage::{Archive, Inspection, Postgres, ServerFacts, inspect_database, look_at_server};

/// Versions before 13 are not tried.
const OLDEST: i64 = 130_000;
/// Times of several stations stand side by side: beyond this, seconds, their order is no longer to be trusted.
const CLOCK_WATCH_S: f64 = 1.0;
const CLOCK_WARNING_S: f64 = 30.0;

/// What the server says, and the archive in it if there is one.
pub(super) async fn database(config: &Config) -> (Vec<Finding>, Option<Inspection>) {
    let check = "database";
    let warning = |error: &dyn std::error::Error| {
        let remedy = "Do what it says; docs/deployment.md tells how to share a PostgreSQL.";
        Finding::warning(check, with_reasons(error), remedy)
    };
    let postgres = match run::postgres(config) {
        Ok(Some(postgres)) => postgres,
        Ok(None) => return (Vec::new(), None),
        Err(error) => return (vec![warning(&error)], None),
    };
    let facts = match look_at_server(&postgres, &SystemClock::new()).await {
        Ok(facts) => facts,
        Err(error) => {
            let mut finding = warning(&error);
            finding.found = format!("{}: {}", postgres.url(), finding.found);
            return (vec![finding], None);
        }
    };
    let mut findings = vec![durability(&facts), clock(&facts)];
    if let Some(finding) = unfit(&facts) {
        findings.insert(0, finding);
        return (findings, None);
    }
    if !facts.has_archive {
        let told = format!("{} answers and is empty: the first start makes the tables", postgres.url());
        findings.insert(0, Finding::ok(check, told));
        return (findings, None);
    }
    let archive = Archive { folder: config.storage.folder.clone(), postgres: Some(postgres.clone()) };
    match inspect_database(&archive).await {
        Ok(inspection) => {
            findings.insert(0, contents(config, &postgres, &facts, &inspection));
            (findings, Some(inspection))
        }
        Err(error) => {
            findings.insert(0, warning(&error));
            (findings, None)
        }
    }
}

/// Why no station could work on it, if so.
fn unfit(facts: &ServerFacts) -> Option<Finding> {
    let known = migrations::newest_postgres();
    let warning = |told: String, remedy: &str| Some(Finding::warning("database", told, remedy));
    if facts.schema > known {
        let told = format!("it has schema {}, this program knows up to {known}", facts.schema);
        return warning(told, "Start the newer program that made it.");
    }
    if facts.version_number < OLDEST {
        let told = format!("it is PostgreSQL {}", facts.version_number / 10_000);
        return warning(told, "Use 13 or newer.");
    }
    if facts.is_standby {
        return warning("it is a standby and takes nothing".into(), "Name the primary in storage.database.");
    }
    if facts.schema < known && !facts.may_make_tables {
        let told = "this user may make no tables in it, and there are some to be made".to_owned();
        return warning(told, "Make the user its owner: `alter database NAME owner to USER`.");
    }
    None
}

fn contents(config: &Config, postgres: &Postgres, facts: &ServerFacts, inspection: &Inspection) -> Finding {
    let (check, known) = ("database", migrations::newest_postgres());
    let found = &inspection.facts;
    let told = format!(
        "{} answers ({} rows looked at): {} frames or more, {} events, schema {}, {}, stations {}",
        postgres.url(),
        inspection.rows_checked,
        found.last_frame & ((1 << 40) - 1),
        found.last_event,
        found.schema,
        inspection.engine,
        facts.stations.join(", "),
    );
    if found.simulated != config.is_simulated() {
        let made = if found.simulated { "simulation" } else { "real station" };
        let remedy = "Use another database (storage.database): simulated and real never meet.";
        Finding::warning(check, format!("it was made by a {made}"), remedy)
    } else if found.schema < known {
        let remedy = format!("The next start brings it to schema {known}: take a pg_dump before.");
        Finding::watch(check, told, remedy)
    } else if !facts.stations.contains(&config.station.name) {
        let remedy =
            format!("The next start adds {} to them; is it the right database?", config.station.name);
        Finding::watch(check, told, remedy)
    } else {
        Finding::ok(check, told)
    }
}

/// What was acknowledged must be on its disk.
fn durability(facts: &ServerFacts) -> Finding {
    let check = "database's disk";
    let settings = [
        ("synchronous_commit", &facts.synchronous_commit, true),
        ("fsync", &facts.fsync, false),
        ("full_page_writes", &facts.full_page_writes, false),
    ];
    let wrong = settings.iter().find(|(name, value, _)| {
        *value != "on" && !(*name == "synchronous_commit" && *value == "remote_apply")
    });
    match wrong {
        None => Finding::ok(check, "synchronous_commit, fsync and full_page_writes are on"),
        Some((name, value, refused)) => Finding::warning(
            check,
            format!(
                "{name} = {value}: what was acknowledged does not survive a power cut{}",
                if *refused { "; the server does not start on it" } else { "" }
            ),
            format!(
                "Set {name} = on in postgresql.conf; connect to PostgreSQL itself, not through a pooler."
            ),
        ),
    }
}

fn clock(facts: &ServerFacts) -> Finding {
    let check = "database's clock";
    let ahead_s = facts.clock_ahead_us as f64 / 1e6;
    let told = match ahead_s {
        0.0.. => format!("{ahead_s:.3} s ahead of this machine's"),
        _ => format!("{:.3} s behind this machine's", -ahead_s),
    };
    let remedy = "Synchronise both machines (chrony, systemd-timesyncd): times of several stations stand side by side in it.";
    match ahead_s.abs() {
        CLOCK_WARNING_S.. => Finding::warning(check, told, remedy),
        CLOCK_WATCH_S.. => Finding::watch(check, told, remedy),
        _ => Finding::ok(check, told),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Verdict;
    use super::*;

    fn good() -> ServerFacts {
        ServerFacts {
            version_number: 150_004,
            synchronous_commit: "on".into(),
            fsync: "on".into(),
            full_page_writes: "on".into(),
            is_standby: false,
            has_archive: true,
            schema: migrations::newest_postgres(),
            may_make_tables: true,
            stations: vec!["bench".into()],
            clock_ahead_us: 1_000,
        }
    }

    #[test]
    fn what_no_station_can_work_on_is_a_warning() {
        assert_eq!(unfit(&good()), None);
        let old = ServerFacts { version_number: 120_017, ..good() };
        let newer = ServerFacts { schema: good().schema + 1, ..good() };
        let standby = ServerFacts { is_standby: true, ..good() };
        let poor = ServerFacts { schema: 0, may_make_tables: false, ..good() };
        for (facts, says) in
            [(old, "PostgreSQL 12"), (newer, "knows up to"), (standby, "standby"), (poor, "no tables")]
        {
            let finding = unfit(&facts).unwrap();
            assert_eq!(finding.verdict, Verdict::Warning);
            assert!(finding.found.contains(says), "{finding:?}");
        }
        let done = ServerFacts { may_make_tables: false, ..good() };
        assert_eq!(unfit(&done), None, "nothing is left to be made");
    }

    #[test]
    fn a_database_that_forgets_is_a_warning_and_remote_apply_is_not() {
        assert_eq!(durability(&good()).verdict, Verdict::Ok);
        let remote = ServerFacts { synchronous_commit: "remote_apply".into(), ..good() };
        assert_eq!(durability(&remote).verdict, Verdict::Ok);
        for facts in [
            ServerFacts { synchronous_commit: "off".into(), ..good() },
            ServerFacts { synchronous_commit: "local".into(), ..good() },
            ServerFacts { fsync: "off".into(), ..good() },
            ServerFacts { full_page_writes: "off".into(), ..good() },
        ] {
            assert_eq!(durability(&facts).verdict, Verdict::Warning, "{facts:?}");
        }
    }

    #[test]
    fn clocks_that_differ_are_told_with_the_right_sign() {
        let cases = [(200_000, Verdict::Ok), (-2_000_000, Verdict::Watch), (90_000_000, Verdict::Warning)];
        for (clock_ahead_us, verdict) in cases {
            let finding = clock(&ServerFacts { clock_ahead_us, ..good() });
            assert_eq!(finding.verdict, verdict, "{finding:?}");
            assert_eq!(finding.found.contains("behind"), clock_ahead_us < 0, "{finding:?}");
        }
    }
}
