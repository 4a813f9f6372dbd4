//! Memory asked for before it is needed, so that its lack is an error and no abort.

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
}
