//! Opening packed chunks: LZ4 by `mcap` itself, zstd by a decoder in Rust, and a limit for both.
//!
//! Our own files are packed with LZ4. Other programs (rosbag2, `mcap`, its package for Python) pack
//! with zstd unless told otherwise. The C library would add half a minute to a cold build, and
//! `ruzstd` adds 3 s.
//!
//! A damaged or hostile chunk of 50 bytes may say that it holds 256 MiB. Believing each of ten
//! thousand such chunks takes minutes. So [`Budget`] bounds the work by the size of the file.

use mcap::records::ChunkHeader;
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

/// The name of LZ4 in a chunk's header.
const LZ4: &str = "lz4";
/// The name of zstd in a chunk's header.
pub(crate) const ZSTD: &str = "zstd";

/// A byte of LZ4 gives at most so many.
const LZ4_RATIO: u64 = 255;
/// How many bytes of zstd it unpacks before it looks at the budget again.
const STEP: usize = 1 << 20;
/// Bytes that all chunks of a file may hold whatever their packed size is.
const FREE: u64 = 1 << 30;
/// Bytes that they may hold besides, for each byte of the file.
const RATIO: u64 = 300;

/// How much a file's chunks may still hold.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    left: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { left: FREE }
    }
}

impl Budget {
    /// Subtracts the size that a chunk of so many packed bytes says it has.
    ///
    /// # Errors
    /// A chunk cannot be so large, or the file's chunks say that they hold more than is likely.
    pub(crate) fn take(&mut self, header: &ChunkHeader, packed: u64) -> McapResult<()> {
        let size = header.uncompressed_size;
        let most = match header.compression.as_str() {
            "" => packed,
            LZ4 => packed.saturating_mul(LZ4_RATIO),
            _ => u64::MAX,
        };
        self.left = self.left.saturating_add(packed.saturating_mul(RATIO));
        if size > most || size > self.left {
            return Err(McapError::ChunkTooLarge(size));
        }
        self.left -= size;
        Ok(())
    }
}

/// The content of a chunk of zstd, at most so many bytes. A false size costs nothing, because
/// memory is taken only when it is needed.
///
/// # Errors
/// It is damaged, or holds more.
pub(crate) fn unpack(packed: &[u8], most: usize) -> McapResult<Vec<u8>> {
    let failed = |error: FrameDecoderError| McapError::DecompressionError(error.to_string());
    frames(packed, most).map_err(failed)
}

fn frames(mut packed: &[u8], most: usize) -> Result<Vec<u8>, FrameDecoderError> {
    let (mut ready, mut decoder) = (Vec::new(), FrameDecoder::new());
    while !packed.is_empty() {
        match decoder.init(&mut packed) {
            Ok(()) => {}
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                length,
                ..
            })) => {
                let rest = packed.get(length as usize..);
                packed = rest.ok_or(FrameDecoderError::FailedToSkipFrame)?;
                continue;
            }
            Err(error) => return Err(error),
        }
        let mut steps = 0;
        while !decoder.is_finished() {
            // The decoder keeps the bytes to which the frame may still refer, however many they
            // are.
            steps += 1;
            if steps * STEP > most + 2 * STEP {
                return Err(FrameDecoderError::TargetTooSmall);
            }
            decoder.decode_blocks(&mut packed, BlockDecodingStrategy::UptoBytes(STEP))?;
            ready.extend(decoder.collect().unwrap_or_default());
            if ready.len() > most {
                return Err(FrameDecoderError::TargetTooSmall);
            }
        }
    }
    Ok(ready)
}

/// Unpacks zstd for a reader that gives all of a chunk, and room for all that it holds.
pub(crate) struct Zstd;

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        0
    }

    fn decompress(&mut self, packed: &[u8], into: &mut [u8]) -> McapResult<DecompressResult> {
        let ready = unpack(packed, into.len())?;
        into[..ready.len()].copy_from_slice(&ready);
        Ok(DecompressResult {
            consumed: packed.len(),
            wrote: ready.len(),
        })
    }

    fn reset(&mut self) -> McapResult<()> {
        Ok(())
    }

    fn name(&self) -> &'static str {
        ZSTD
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(compression: &str, size: u64) -> ChunkHeader {
        ChunkHeader {
            message_start_time: 0,
            message_end_time: 0,
            uncompressed_size: size,
            uncompressed_crc: 0,
            compression: compression.to_owned(),
            compressed_size: 0,
        }
    }

    #[test]
    fn a_chunk_holds_no_more_than_its_packing_can() {
        let takes = |compression, size| {
            let taken = Budget::default().take(&header(compression, size), 100);
            taken.is_ok()
        };
        assert!(takes("", 100) && !takes("", 101));
        assert!(takes(LZ4, 25_500) && !takes(LZ4, 25_501));
        assert!(takes(ZSTD, FREE) && !takes(ZSTD, FREE + 30_001));
    }

    #[test]
    fn all_chunks_together_hold_no_more_than_a_file_of_that_size_can() {
        let mut budget = Budget::default();
        let chunk = header(ZSTD, 256 << 20);
        let taken = (0..10_000).filter(|_| budget.take(&chunk, 50).is_ok());
        assert_eq!(taken.count(), 4);
        // A file that is as large as it says goes on for ever.
        let mut budget = Budget::default();
        let chunk = header(ZSTD, 4 << 20);
        assert!((0..10_000).all(|_| budget.take(&chunk, 1 << 20).is_ok()));
    }
}
