//! Files for other programs: made and written on a thread of their own, never over one that is there.

pub(super) mod drawing;
pub(super) mod table;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::Scene;
use crate::link::Courier;

type Outcome = Result<PathBuf, String>;

/// The files that are being written, and what became of the last one.
#[derive(Default)]
pub(super) struct Exports {
    writing: Option<Arc<Mutex<Option<Outcome>>>>,
    last: Option<Outcome>,
}

impl Exports {
    /// Whether one is being written: one at a time.
    pub(super) fn is_busy(&self) -> bool {
        self.writing.is_some()
    }

    /// Makes and writes a file.
    pub(super) fn save(
        &mut self,
        folder: Option<&str>,
        name: &str,
        courier: &Courier,
        make: impl FnOnce() -> Result<Vec<u8>, String> + Send + 'static,
    ) {
        if self.is_busy() {
            return;
        }
        let path = Path::new(folder.filter(|folder| !folder.is_empty()).unwrap_or(".")).join(name);
        let slot = Arc::new(Mutex::new(None));
        let (done, courier) = (Arc::clone(&slot), courier.clone());
        let work = move || {
            let outcome = make().and_then(|bytes| {
                write(&path, &bytes).map_err(|error| format!("{}: {error}", path.display()))
            });
            *done.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
            courier.wake();
        };
        match std::thread::Builder::new().name("export".to_owned()).spawn(work) {
            Ok(_) => self.writing = Some(slot),
            Err(error) => self.fail(format!("this machine gives no thread: {error}")),
        }
    }

    /// Nothing could be made.
    pub(super) fn fail(&mut self, why: String) {
        self.last = Some(Err(why));
    }

    /// What became of the last one, in one line.
    pub(super) fn show(&mut self, ui: &mut egui::Ui) {
        if let Some(slot) = &self.writing
            && let Some(outcome) = slot.lock().unwrap_or_else(PoisonError::into_inner).take()
        {
            self.last = Some(outcome);
        }
        if self.writing.as_ref().is_some_and(|slot| Arc::strong_count(slot) == 1) {
            // Its thread ended: with an outcome, or it died.
            self.writing = None;
            self.last.get_or_insert_with(|| Err("the file could not be made".to_owned()));
        }
        match &self.last {
            _ if self.is_busy() => drop(ui.weak("Writing the file")),
            Some(Ok(path)) => drop(ui.weak(format!("Written: {}", path.display()))),
            Some(Err(why)) => drop(ui.label(format!("Not written: {why}"))),
            None => {}
        }
    }
}

/// A line to type the folder of exported files into.
pub(super) fn folder(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let mut folder = scene.desk.plots.folder.clone().unwrap_or_default();
    let edit = egui::TextEdit::singleline(&mut folder).hint_text("folder of files").desired_width(140.0);
    let edit = ui.add(edit).on_hover_text("Where exported files are put");
    edit.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Folder of exported files"));
    if edit.changed() {
        scene.desk.plots.folder = Some(folder).filter(|folder| !folder.is_empty());
    }
}

/// The server's time as it stands in a file's name.
pub(super) fn stamp(now_us: Option<i64>) -> String {
    let at = super::history::at(now_us.unwrap_or(0));
    ui::format::utc(at).chars().filter(|letter| *letter != '-' && *letter != ':').collect()
}

/// A new file, whole; where there is one of that name, it gets a number.
fn write(path: &Path, bytes: &[u8]) -> std::io::Result<PathBuf> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let (stem, ending) = (
        path.file_stem().unwrap_or_default().to_string_lossy(),
        path.extension().unwrap_or_default().to_string_lossy(),
    );
    let mut place = path.to_owned();
    for number in 2..1000 {
        match std::fs::File::create_new(&place) {
            Ok(mut file) => {
                file.write_all(bytes)?;
                file.sync_all()?;
                return Ok(place);
            }
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                place = path.with_file_name(format!("{stem}-{number}.{ending}"));
            }
            Err(error) => return Err(error),
        }
    }
    Err(std::io::Error::from(std::io::ErrorKind::AlreadyExists))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_there_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/a.csv");
        assert_eq!(write(&path, b"one").unwrap(), path);
        let second = write(&path, b"two").unwrap();
        assert_eq!(second.file_name().unwrap(), "a-2.csv");
        assert_eq!(std::fs::read(&path).unwrap(), b"one");
        assert_eq!(std::fs::read(&second).unwrap(), b"two");
    }
}
