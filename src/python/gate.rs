//! The one gate between Python and the core: releases the GIL, watches for Ctrl-C, reports progress,
//! maps errors.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::control::Control;
use crate::error::{Error, Result};

/// How long the watching thread waits between two looks for Ctrl-C.
const WATCH_INTERVAL: Duration = Duration::from_millis(25);

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Invalid { .. } => PyValueError::new_err(error.to_string()),
            Error::NotConverged { .. } => PyRuntimeError::new_err(error.to_string()),
            Error::Stopped => PyKeyboardInterrupt::new_err("stopped"),
        }
    }
}

/// Runs `work` on a thread of its own without the GIL, while this one watches for signals and calls
/// `progress(done)`; an exception from either stops the work and is raised once it has ended.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Control) -> Result<T> + Send,
) -> PyResult<T> {
    let control = Control::default();
    let mut interruption = None;
    let result = thread::scope(|scope| {
        let (send, mut receive) = mpsc::sync_channel(1);
        let control = &control;
        let worker = scope.spawn(move || {
            let _ = send.send(work(control));
        });
        loop {
            // An exclusive borrow: a receiver may be sent to another thread, but not shared.
            let receive = &mut receive;
            match py.detach(move || receive.recv_timeout(WATCH_INTERVAL)) {
                Ok(result) => break result,
                Err(RecvTimeoutError::Timeout) => {}
                // The sender is gone without an answer: the worker panicked.
                Err(RecvTimeoutError::Disconnected) => match worker.join() {
                    Err(panic) => std::panic::resume_unwind(panic),
                    Ok(()) => unreachable!("a worker that ends well has sent its result"),
                },
            }
            if interruption.is_none()
                && let Err(error) = watch(py, progress, control)
            {
                control.stop();
                interruption = Some(error);
            }
        }
    });
    match interruption {
        Some(error) => Err(error),
        None => Ok(result?),
    }
}

fn watch(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>, control: &Control) -> PyResult<()> {
    py.check_signals()?;
    if let Some(report) = progress {
        report.call1((control.done(),))?;
    }
    Ok(())
}
