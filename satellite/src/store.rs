//! The one image the satellite stores, cut into chunks.

use std::sync::Arc;

use protocol::{CHUNK_LEN, ChunkIndex, ImageChunk, ImageInfo, Resolution};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    Camera, ImageSource,
    noise::mix,
    picture::{self, PictureSettings},
    state::StoredImage,
};

/// Chunks are numbered by u16.
const CHUNKS_MAX: u32 = 1 << 16;

/// An image in memory.
#[derive(Clone, Debug)]
pub(crate) struct Image {
    bytes: Arc<[u8]>,
    width_px: u16,
    height_px: u16,
}

impl Image {
    /// Makes the image again from its recipe; `None` if the camera cannot.
    pub(crate) fn recall(
        seed: u64,
        recipe: &StoredImage,
        source: &ImageSource,
        camera: Camera,
    ) -> Option<Self> {
        if recipe.number == 0
            && let ImageSource::Bytes { bytes, width_px, height_px } = source
        {
            return Some(Self { bytes: Arc::clone(bytes), width_px: *width_px, height_px: *height_px });
        }
        let (width_px, height_px) = recipe.resolution.size_px();
        let seed = mix(seed ^ u64::from(recipe.number).wrapping_mul(0x9e37));
        let bytes = match camera {
            Camera::Broken if recipe.number > 0 => return None,
            Camera::Picture | Camera::Broken => picture::take(&PictureSettings {
                seed,
                width_px,
                height_px,
                grey: recipe.grey,
                strong_compression: recipe.strong_compression,
            }),
            Camera::Pattern { size_bytes } => {
                let mut bytes = vec![0; size_bytes as usize];
                ChaCha8Rng::seed_from_u64(seed).fill_bytes(&mut bytes);
                bytes
            }
        };
        Some(Self { bytes: bytes.into(), width_px, height_px })
    }

    /// The recipe of the image a satellite is launched with.
    pub(crate) const fn first_recipe() -> StoredImage {
        StoredImage { number: 0, resolution: Resolution::Cif, grey: false, strong_compression: false }
    }

    pub(crate) const fn bytes(&self) -> &Arc<[u8]> {
        &self.bytes
    }

    pub(crate) fn chunks(&self) -> u32 {
        u32::try_from(self.bytes.len().div_ceil(CHUNK_LEN)).unwrap_or(CHUNKS_MAX).min(CHUNKS_MAX)
    }

    pub(crate) fn info(&self) -> ImageInfo {
        ImageInfo {
            exists: true,
            chunks: self.chunks(),
            size_bytes: u32::try_from(self.bytes.len()).unwrap_or(u32::MAX),
            width_px: self.width_px,
            height_px: self.height_px,
        }
    }

    /// The chunk of this number; `None` behind the end.
    pub(crate) fn chunk(&self, number: u32) -> Option<ImageChunk> {
        let index = u16::try_from(number).ok()?;
        let rest = self.bytes.get(usize::from(index) * CHUNK_LEN..).filter(|rest| !rest.is_empty())?;
        let mut data = [0; CHUNK_LEN];
        data.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        Some(ImageChunk { index: ChunkIndex(index), data })
    }

    /// The numbers `first..first + count` as far as they exist.
    pub(crate) fn range(&self, first: u16, count: u16) -> std::ops::Range<u32> {
        let first = u32::from(first);
        first..(first + u32::from(count)).min(self.chunks()).max(first)
    }
}

/// What ImageInfo says when there is no image.
pub(crate) const NO_IMAGE: ImageInfo =
    ImageInfo { exists: false, chunks: 0, size_bytes: 0, width_px: 0, height_px: 0 };

#[cfg(test)]
mod tests {
    use super::*;

    fn image(len: usize) -> Image {
        Image { bytes: vec![7; len].into(), width_px: 1, height_px: 1 }
    }

    #[test]
    fn chunks_cover_the_file_and_the_last_is_padded() {
        assert_eq!(image(0).chunks(), 0);
        assert_eq!(image(222).chunks(), 1);
        let image = image(223);
        assert_eq!(image.chunks(), 2);
        let last = image.chunk(1).unwrap();
        assert_eq!((last.data[0], last.data[1], last.data[221]), (7, 0, 0));
        assert!(image.chunk(2).is_none() && image.chunk(70_000).is_none());
        assert!(image.info().is_consistent());
    }

    #[test]
    fn ranges_are_summed_without_wrapping() {
        let image = image(222 * 10);
        assert_eq!(image.range(2, 3), 2..5);
        assert_eq!(image.range(8, u16::MAX), 8..10);
        assert!(image.range(10, 1).is_empty() && image.range(u16::MAX, u16::MAX).is_empty());
        assert!(image.range(3, 0).is_empty());
    }

    #[test]
    fn the_recipe_makes_the_same_bytes_again() {
        let camera = Camera::Pattern { size_bytes: 1_000 };
        let recipe = Image::first_recipe();
        let recall = |recipe: &StoredImage| {
            Image::recall(5, recipe, &ImageSource::Camera, camera).unwrap().bytes().to_vec()
        };
        assert_eq!(recall(&recipe), recall(&recipe));
        assert_ne!(recall(&recipe), recall(&StoredImage { number: 1, ..recipe }));
    }
}
