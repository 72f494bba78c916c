//! Passwords and tokens, from files that only their owner can read. Read anew each time, never kept.

use std::path::Path;

use zeroize::Zeroizing;

/// The one line of a private file.
///
/// # Errors
/// Why there is none, with the remedy; never the content.
pub(crate) async fn load(path: &Path) -> Result<Zeroizing<String>, String> {
    let path = path.to_owned();
    let read = tokio::task::spawn_blocking(move || crate::alerts::secret_of_file(&path));
    read.await.map_err(|error| error.to_string())?
}
