//! What the twin flies, from a file of elements.

use std::io;
use std::path::{Path, PathBuf};

use satellite::Orbit;
use tle::UtcInstant;
use tle::formats::{Checksums, SourceError};
use tle::propagator::ElementsError;

use crate::sky::{Catalogue, Object};

/// Names of other objects that an error shows.
const NAMES_SHOWN: usize = 5;

/// Why a file gives no orbit.
#[derive(Debug, thiserror::Error)]
pub enum OrbitError {
    /// It cannot be read.
    #[error("elements {path} cannot be read", path = .path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It holds no elements.
    #[error("elements {path}", path = .path.display())]
    Text {
        /// Which.
        path: PathBuf,
        /// What it is instead.
        source: SourceError,
    },
    /// Every set in it is broken.
    #[error("elements {path}: no set can be used; {first}", path = .path.display())]
    Broken {
        /// Which.
        path: PathBuf,
        /// The first of them, with its line.
        first: String,
    },
    /// Nothing in it has the name.
    #[error("elements {path}: {problem}", path = .path.display())]
    Absent {
        /// Which.
        path: PathBuf,
        /// The name, and some that are there.
        problem: String,
    },
    /// There are several objects, and a twin is one.
    #[error("elements {path} hold {count} objects: choose one with --satellite, such as {some}", path = .path.display())]
    Choose {
        /// Which.
        path: PathBuf,
        /// How many.
        count: usize,
        /// Some of them.
        some: String,
    },
    /// SGP4 refuses the set.
    #[error("elements {path}: {object}", path = .path.display())]
    Elements {
        /// Which.
        path: PathBuf,
        /// Whose.
        object: String,
        /// Why.
        source: ElementsError,
    },
}

/// The orbit of one object in a file of elements, OMM or TLE: of several sets the newest at or before this instant. `wanted`
/// is a name, a catalogue number or a designator; a file with one object needs none. Broken sets beside it are logged.
///
/// # Errors
/// [`OrbitError`].
pub fn orbit_from(file: &Path, wanted: Option<&str>, at: UtcInstant) -> Result<Orbit, OrbitError> {
    let path = || file.to_owned();
    let bytes = std::fs::read(file).map_err(|source| OrbitError::File { path: path(), source })?;
    let mut catalogue = Catalogue::default();
    catalogue
        .read(&file.display().to_string(), &bytes, Checksums::Strict)
        .map_err(|source| OrbitError::Text { path: path(), source })?;
    for warning in &catalogue.warnings {
        tracing::warn!("{warning}");
    }
    for set in &catalogue.refused {
        tracing::warn!(line = set.line, "{}, line {}: {}", set.source, set.line, set.error);
    }
    if let (true, Some(set)) = (catalogue.objects.is_empty(), catalogue.refused.first()) {
        let first = format!("line {}: {}", set.line, set.error);
        return Err(OrbitError::Broken { path: path(), first });
    }
    if let Some(wanted) = wanted {
        let kept = catalogue.keep(&[wanted.to_owned()]);
        kept.map_err(|problem| OrbitError::Absent { path: path(), problem })?;
    }
    let [object] = &catalogue.objects[..] else {
        let some: Vec<String> = catalogue.objects.iter().take(NAMES_SHOWN).map(Object::label).collect();
        return Err(OrbitError::Choose {
            path: path(),
            count: catalogue.objects.len(),
            some: some.join(", "),
        });
    };
    Orbit::new(object.set_for(at).clone()).map_err(|source| OrbitError::Elements {
        path: path(),
        object: object.label(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ISS: &str = "ISS (ZARYA)\n\
        1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
        2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";

    fn at() -> UtcInstant {
        "2020-07-14T00:00:00Z".parse().unwrap()
    }

    fn read(text: &str, wanted: Option<&str>) -> Result<Orbit, OrbitError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("elements.txt");
        std::fs::write(&file, text).unwrap();
        orbit_from(&file, wanted, at())
    }

    #[test]
    fn one_object_needs_no_name_and_several_do() {
        assert_eq!(read(ISS, None).unwrap().elements().norad_cat_id, Some(25_544));
        let other = tle::formats::write(tle::formats::Form::ThreeLine, &[other()]).unwrap();
        let both = format!("{ISS}{other}");
        let error = read(&both, None).unwrap_err();
        assert!(matches!(error, OrbitError::Choose { count: 2, .. }), "{error}");
        assert!(error.to_string().contains("ISS (ZARYA)"), "{error}");
        assert_eq!(read(&both, Some("iss (zarya)")).unwrap().elements().norad_cat_id, Some(25_544));
        assert_eq!(read(&both, Some("99")).unwrap().elements().norad_cat_id, Some(99));
        assert!(matches!(read(&both, Some("100")), Err(OrbitError::Absent { .. })));
    }

    fn other() -> tle::Elements {
        let made = Orbit::fictional(1, at());
        let named = Some("OTHER".to_owned());
        tle::Elements { name: named, norad_cat_id: Some(99), ..made.elements().clone() }
    }

    #[test]
    fn what_is_no_elements_says_so() {
        assert!(matches!(read("<html>", None), Err(OrbitError::Text { .. })));
        let broken = read(&ISS.replace("  9992", "  9991"), None).unwrap_err();
        assert!(broken.to_string().contains("line 2"), "{broken}");
        assert!(matches!(orbit_from(Path::new("/nowhere/at.all"), None, at()), Err(OrbitError::File { .. })));
    }
}
