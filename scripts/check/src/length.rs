//! File lengths: 100 to 400 lines read well; a longer file is noted, and one beyond reason refused.

use std::path::Path;

use crate::{Finding, TextFile};

/// Above this many lines a file is noted.
const NOTED_LINES: usize = 400;
/// Above this many lines a file is refused: the idea in it has not been cut into rooms yet.
const REFUSED_LINES: usize = 700;

/// Notes for long files, and findings for files that are far too long.
pub(crate) fn check(files: &[TextFile]) -> (Vec<Finding>, Vec<Finding>) {
    let mut notes = Vec::new();
    let mut refused = Vec::new();
    for file in files.iter().filter(|file| !carries_vectors(&file.path)) {
        let lines = file.text.lines().count();
        let place = file.path.display().to_string();
        if lines > REFUSED_LINES {
            refused.push(Finding::new(
                place,
                format!("{lines} lines, more than {REFUSED_LINES}: cut it where its ideas part"),
            ));
        } else if lines > NOTED_LINES {
            notes.push(Finding::new(place, format!("{lines} lines, more than {NOTED_LINES}")));
        }
    }
    (notes, refused)
}

/// Wire vectors are lists, not prose: as long as the wire is.
fn carries_vectors(path: &Path) -> bool {
    path.iter().filter_map(|part| part.to_str()).any(|part| part == "vectors" || part.starts_with("vectors."))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, lines: usize) -> TextFile {
        TextFile { path: path.into(), text: "line\n".repeat(lines) }
    }

    #[test]
    fn long_file_is_noted_and_far_too_long_file_is_refused() {
        let (notes, refused) =
            check(&[file("a.rs", 400), file("b.rs", 401), file("c.rs", 700), file("d.rs", 701)]);
        let places = |findings: &[Finding]| findings.iter().map(|f| f.place.clone()).collect::<Vec<_>>();
        assert_eq!(places(&notes), ["b.rs", "c.rs"]);
        assert_eq!(places(&refused), ["d.rs"]);
    }

    #[test]
    fn wire_vectors_may_be_long() {
        let (notes, refused) = check(&[
            file("protocol/tests/vectors/heartbeat.rs", 5000),
            file("protocol/tests/vectors.rs", 900),
        ]);
        assert!(notes.is_empty() && refused.is_empty());
    }
}
