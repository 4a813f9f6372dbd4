//! Memory asked for before it is needed, so that its lack is an error and no abort.

use std::hint::black_box;

use crate::error::{Error, Result};

/// [`Error::OutOfMemory`] unless `work`, which is described by what is done, can have `bytes` now.
pub fn claim(work: &str, bytes: usize) -> Result<()> {
    let error = || Error::OutOfMemory { work: work.to_owned(), bytes: bytes as u64 };
    // What a limit of the process forbids; given back at once, it is there for the work.
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| error())?;
    // Linux promises memory that it does not have, and ends those who use it.
    if available().is_some_and(|available| bytes as u64 > available) {
        Err(error())
    } else {
        Ok(())
    }
}

/// A table of `count` values; [`Error::OutOfMemory`] if there is no room for it.
pub fn table<T>(work: &str, count: usize, value: impl FnMut() -> T) -> Result<Vec<T>> {
    let bytes = count.saturating_mul(size_of::<T>());
    let mut table = Vec::new();
    table
        .try_reserve_exact(count)
        .map_err(|_| Error::OutOfMemory { work: work.to_owned(), bytes: bytes as u64 })?;
    table.resize_with(count, value);
    Ok(table)
}

/// Whether the process may have `bytes` more, for what can be done without.
pub fn has_room(bytes: usize) -> bool {
    black_box(Vec::<u8>::new()).try_reserve_exact(bytes).is_ok()
}

/// Bytes that the machine can give, where it says so.
fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_an_error_that_says_how_much() {
        assert_eq!(claim("weaving", 1 << 20), Ok(()));
        for bytes in [1 << 50, usize::MAX] {
            let error = claim("weaving", bytes).unwrap_err();
            assert!(matches!(error, Error::OutOfMemory { .. }));
            assert!(error.to_string().starts_with("weaving takes "), "{error}");
        }
    }

    #[test]
    fn tables_that_there_is_no_room_for_are_errors() {
        assert_eq!(table("weaving", 3, || 7), Ok(vec![7; 3]));
        let error = table("weaving", usize::MAX / 8, || 0u64).unwrap_err();
        assert!(matches!(error, Error::OutOfMemory { .. }));
    }

    #[test]
    fn there_is_room_for_little_but_not_for_all() {
        assert!(has_room(1 << 20) && !has_room(usize::MAX));
    }
}
