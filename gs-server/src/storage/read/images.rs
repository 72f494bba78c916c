//! Images, what is held of them, and the standing orders to bring them home.

use super::super::{ChunkRow, DownloadRow, ImageRow, Store, StoreError};
use super::{List, Page, Scope, all, one};

/// Bytes of an image in one chunk.
const CHUNK_BYTES: usize = protocol::CHUNK_LEN;

/// An image and what is held of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageMap {
    /// The image.
    pub image: ImageRow,
    /// One entry per chunk, in order.
    pub chunks: Vec<ChunkState>,
}

/// What is held of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkState {
    /// Which, from 0.
    pub index: u32,
    /// The frame that brought it; `None` while it is missing.
    pub frame: Option<i64>,
    /// The station that heard it.
    pub station: Option<String>,
    /// When.
    pub at_us: Option<i64>,
    /// Frames that brought versions that differ: kept, and used for nothing.
    pub conflicts: Vec<i64>,
}

/// The bytes of an image as far as they are held.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageBytes {
    /// As long as the declared size; what is missing is zero.
    pub bytes: Vec<u8>,
    /// So many bytes from the beginning are held without a gap.
    pub contiguous: usize,
    /// Whether nothing is missing.
    pub complete: bool,
}

impl Store {
    /// Images, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn images(&self, scope: &Scope, page: &Page) -> Result<Vec<ImageRow>, StoreError> {
        List::of::<ImageRow>().scope("declared_at_us", scope).page(self, "id", page).await
    }

    /// An image and the map of its chunks.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn image(&self, id: i64) -> Result<Option<ImageMap>, StoreError> {
        let Some(image) = one::<ImageRow>(self, "where id = ?", id).await? else { return Ok(None) };
        let mut chunks: Vec<ChunkState> = (0..chunk_count(&image))
            .map(|index| ChunkState { index, frame: None, station: None, at_us: None, conflicts: Vec::new() })
            .collect();
        for row in self.chunks(id).await? {
            let Some(state) = usize::try_from(row.chunk_index).ok().and_then(|index| chunks.get_mut(index))
            else {
                continue;
            };
            if row.conflict {
                state.conflicts.push(row.frame);
            } else {
                state.frame = Some(row.frame);
                state.station = Some(row.station);
                state.at_us = Some(row.at_us);
            }
        }
        Ok(Some(ImageMap { image, chunks }))
    }

    /// The bytes of an image, put together from the chunks that are held and cut at its size.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn image_bytes(&self, id: i64) -> Result<Option<ImageBytes>, StoreError> {
        let Some(image) = one::<ImageRow>(self, "where id = ?", id).await? else { return Ok(None) };
        let chunks = self.chunks(id).await?;
        let count = chunk_count(&image) as usize;
        let mut bytes = vec![0; count * CHUNK_BYTES];
        let mut held = vec![false; count];
        for row in chunks.iter().filter(|row| !row.conflict) {
            let Ok(index) = usize::try_from(row.chunk_index) else { continue };
            if let Some(place) = bytes.chunks_exact_mut(CHUNK_BYTES).nth(index)
                && let Some(held) = held.get_mut(index)
                && place.len() == row.data.len()
            {
                place.copy_from_slice(&row.data);
                *held = true;
            }
        }
        let size = usize::try_from(image.size_bytes).unwrap_or(0).min(bytes.len());
        bytes.truncate(size);
        let first_gap = held.iter().position(|held| !held);
        Ok(Some(ImageBytes {
            bytes,
            contiguous: first_gap.map_or(size, |index| (index * CHUNK_BYTES).min(size)),
            complete: first_gap.is_none(),
        }))
    }

    /// All chunks of an image and their other versions.
    async fn chunks(&self, image: i64) -> Result<Vec<ChunkRow>, StoreError> {
        all(self, "where image = ? order by chunk_index, id", image).await
    }

    /// Downloads, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn downloads(&self, scope: &Scope, page: &Page) -> Result<Vec<DownloadRow>, StoreError> {
        List::of::<DownloadRow>().scope("created_at_us", scope).page(self, "id", page).await
    }

    /// A download.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn download(&self, id: i64) -> Result<Option<DownloadRow>, StoreError> {
        one(self, "where id = ?", id).await
    }
}

/// The declared number of chunks; an index has 16 bits, so there cannot be more than 65536.
fn chunk_count(image: &ImageRow) -> u32 {
    u32::try_from(image.chunks).unwrap_or(0).min(1 << 16)
}
