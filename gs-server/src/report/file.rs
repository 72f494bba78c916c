//! Reports as files: whole or not there at all, and still there after a power cut.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::Path;

use api::PassReport;

use super::{Style, html, markdown, pass_document};

/// What the files of a pass are called, without what tells their form: `pass-000017-pixelsat-1-20261122T133920Z`.
#[must_use]
pub fn file_name(pass: i64, satellite: &str, aos: api::Time) -> String {
    let digits = |text: &str| text.chars().filter(|c| *c != '-' && *c != ':').collect::<String>();
    let aos = aos.to_string();
    let at = aos.get(..19).map(digits).unwrap_or_default();
    // A satellite's name is one of the configuration; what stands in an old archive is not relied on.
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    let satellite: String = satellite.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
    format!("pass-{pass:06}-{satellite}-{at}Z")
}

/// Writes the page and the text of a pass into a folder, which is made when it is not there.
///
/// # Errors
/// What the operating system says. The page is written last: where it is, everything is.
pub fn write_pass(folder: &Path, name: &str, report: &PassReport) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    let document = pass_document(report);
    replace(&folder.join(format!("{name}.md")), markdown(&document).as_bytes())?;
    replace(&folder.join(format!("{name}.html")), html(&document, Style::Embedded).as_bytes())?;
    File::open(folder)?.sync_all()
}

/// The page of a pass is there, and so is its text.
#[must_use]
pub(super) fn is_written(folder: &Path, name: &str) -> bool {
    folder.join(format!("{name}.html")).is_file()
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let new = path.with_added_extension("new");
    let mut file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&new)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    fs::rename(&new, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_leads_nowhere_else() {
        let aos = api::Time::from_unix_us(1_795_354_760_875_000);
        assert_eq!(file_name(17, "pixelsat-1", aos), "pass-000017-pixelsat-1-20261122T133920Z");
        assert_eq!(file_name(1, "../a/b\0", aos), "pass-000001-___a_b_-20261122T133920Z");
    }
}
