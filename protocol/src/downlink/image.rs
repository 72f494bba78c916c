//! The stored image and its pieces (ICD section 4).

use crate::{
    CHUNK_LEN, ChunkIndex, PayloadError,
    wire::{Reader, Walk, Wire, Writer, packet},
};

packet! {
    /// ImageInfo, 13 bytes: what image the satellite stores.
    pub struct ImageInfo (13 bytes) {
        /// Whether there is an image; all else is 0 when not, as during a capture.
        exists: bool = ["exists"], "";
        /// Number of chunks.
        chunks: u32 = ["chunks"], "";
        /// Size of the file, bytes.
        size_bytes: u32 = ["image_size"], "B";
        /// Width, pixels.
        width_px: u16 = ["res_x"], "px";
        /// Height, pixels.
        height_px: u16 = ["res_y"], "px";
    }
}

impl ImageInfo {
    /// Whether the number of chunks fits the size; when not, neither is to be relied on.
    #[must_use]
    pub const fn is_consistent(&self) -> bool {
        self.chunks == self.size_bytes.div_ceil(CHUNK_LEN as u32)
    }
}

/// ImageChunk, 224 bytes: a piece of the image, zero padded in the last chunk.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ImageChunk {
    /// Which piece, from 0.
    pub index: ChunkIndex,
    /// The bytes of the image from `index * 222` on.
    pub data: [u8; CHUNK_LEN],
}

impl Wire for ImageChunk {
    const LEN: usize = 2 + CHUNK_LEN;

    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        Ok(Self { index: ChunkIndex(reader.read()?), data: reader.take() })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.write(&self.index.0);
        writer.put(&self.data);
    }

    fn walk(&self, walk: &mut Walk<'_>, _: &[&'static str], _: &'static str) {
        walk.value(&self.index.0, &["index"], "");
        walk.field("data", "", crate::FieldValue::Bytes(&self.data), CHUNK_LEN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consistent_means_chunks_cover_the_size_exactly() {
        let info =
            |chunks, size_bytes| ImageInfo { exists: true, chunks, size_bytes, width_px: 1, height_px: 1 };
        for (chunks, size, is) in [
            (0, 0, true),
            (1, 1, true),
            (1, 222, true),
            (2, 223, true),
            (1, 223, false),
            (u32::MAX, u32::MAX, false),
        ] {
            assert_eq!(info(chunks, size).is_consistent(), is, "{chunks} {size}");
        }
    }
}
