//! Arrows between crates: each member's dependencies against the table in `house`.

use crate::Finding;
use crate::house::{self, Knows};
use crate::metadata::{Dependency, Kind, Package};

/// Every arrow that the table does not allow, and every member that is not in the table.
pub(crate) fn check(packages: &[Package]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for package in packages {
        let Some(room) = house::find(&package.name) else {
            findings.push(Finding::new(
                &package.name,
                "this crate is in no room: give it a line in scripts/check/src/house.rs and in docs/architecture.md",
            ));
            continue;
        };
        for dependency in &package.dependencies {
            if let Some(sentence) = objection(room, dependency) {
                findings.push(Finding::new(&package.name, sentence));
            }
        }
    }
    findings
}

fn objection(room: &house::Room, dependency: &Dependency) -> Option<String> {
    let name = dependency.name.as_str();
    if dependency.path.is_none() {
        let (_, allowed) = house::WALLED_OUTSIDERS.iter().find(|(outsider, _)| *outsider == name)?;
        return (!allowed.contains(&room.name))
            .then(|| format!("must not know {name}: only {} may", allowed.join(", ")));
    }
    let Knows::Only(known) = room.knows else { return None };
    if known.contains(&name) || (dependency.kind == Kind::Dev && room.dev_only.contains(&name)) {
        return None;
    }
    if room.behind_feature.contains(&name) {
        return (!dependency.optional && dependency.kind != Kind::Dev)
            .then(|| format!("may know {name} only behind a feature: make the dependency optional"));
    }
    let whom =
        if known.is_empty() { "nobody of ours".to_owned() } else { format!("only {}", known.join(", ")) };
    Some(format!("must not know {name}: it knows {whom}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ours(name: &str, kind: Kind) -> Dependency {
        Dependency {
            name: name.to_owned(),
            kind,
            optional: false,
            path: Some(format!("/house/{name}").into()),
        }
    }

    fn outsider(name: &str, kind: Kind) -> Dependency {
        Dependency { path: None, ..ours(name, kind) }
    }

    fn package(name: &str, dependencies: Vec<Dependency>) -> Package {
        Package {
            name: name.to_owned(),
            manifest_path: format!("/house/{name}/Cargo.toml").into(),
            dependencies,
        }
    }

    fn sentences(package: Package) -> Vec<String> {
        check(&[package]).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn forbidden_arrow_is_found() {
        let found = sentences(package("protocol", vec![ours("mission", Kind::Normal)]));
        assert_eq!(found, ["protocol: must not know mission: it knows nobody of ours"]);
    }

    #[test]
    fn mission_must_not_know_the_satellite_even_in_tests() {
        assert_eq!(sentences(package("mission", vec![ours("satellite", Kind::Dev)])).len(), 1);
        assert_eq!(sentences(package("satellite", vec![ours("mission", Kind::Build)])).len(), 1);
    }

    #[test]
    fn allowed_arrows_are_silent() {
        let rehearsal =
            package("rehearsal", vec![ours("mission", Kind::Normal), ours("satellite", Kind::Dev)]);
        assert!(check(&[rehearsal, package("radio", vec![ours("protocol", Kind::Normal)])]).is_empty());
    }

    #[test]
    fn test_crates_may_know_everyone() {
        let all = house::ROOMS.iter().map(|room| ours(room.name, Kind::Normal)).collect();
        assert!(check(&[package("end-to-end", all)]).is_empty());
    }

    #[test]
    fn unknown_member_is_found() {
        assert!(
            sentences(package("helpers", Vec::new()))[0].starts_with("helpers: this crate is in no room")
        );
    }

    #[test]
    fn engine_with_tokio_or_sql_is_found() {
        for name in ["tokio", "sqlx"] {
            assert_eq!(sentences(package("rehearsal", vec![outsider(name, Kind::Dev)])).len(), 1, "{name}");
        }
        assert!(check(&[package("rehearsal", vec![outsider("rand", Kind::Normal)])]).is_empty());
    }

    #[test]
    fn desktop_app_knows_the_server_only_behind_a_feature() {
        let plain = ours("gs-server", Kind::Normal);
        let optional = Dependency { optional: true, ..plain.clone() };
        assert_eq!(sentences(package("ground-app", vec![plain])).len(), 1);
        assert!(check(&[package("ground-app", vec![optional])]).is_empty());
    }

    #[test]
    fn cargos_own_words_for_the_kinds_are_read() {
        let kinds: Vec<Kind> = serde_json::from_str(r#"[null, "dev", "build"]"#).unwrap();
        assert_eq!(kinds, [Kind::Normal, Kind::Dev, Kind::Build]);
    }
}
