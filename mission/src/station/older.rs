//! Images before the newest one: chunks of them come late, from others or from a file, and fill their gaps.

use std::collections::VecDeque;

use super::image::Assembly;
use crate::clock::UtcUs;
use crate::snapshot::fits_older;

/// Images of a satellite that are not its newest, the newest of them first.
#[derive(Debug, Default)]
pub(super) struct Older(VecDeque<Assembly>);

impl Older {
    /// As many as are kept of these, the newest first.
    pub(super) fn restore(images: impl Iterator<Item = Assembly>) -> Self {
        let mut older = Self(images.collect());
        older.cut();
        older
    }

    /// An image that is the newest no more.
    pub(super) fn push(&mut self, image: Assembly) {
        self.0.push_front(image);
        self.cut();
    }

    /// The image that was the newest at this time: what the satellite sent then is of this one, as far as anybody knows.
    pub(super) fn of(&mut self, at: UtcUs) -> Option<&mut Assembly> {
        self.0.iter_mut().find(|image| image.record.declared_at <= at)
    }

    /// Where one is let go, those before it are as well: their chunks would be taken for those of another.
    fn cut(&mut self) {
        let kept = fits_older(self.0.iter().map(|image| image.record.chunks));
        self.0.truncate(kept);
    }
}
