//! The one gate between Python and the core: releases the GIL, provides threads, watches for Ctrl-C,
//! reports progress, maps errors.

use std::any::Any;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

use crate::control::Control;
use crate::error::{Error, Result};

/// How long the watching thread waits between two looks for Ctrl-C.
const WATCH_INTERVAL: Duration = Duration::from_millis(25);

create_exception!(
    plycloth,
    ConvergenceError,
    PyRuntimeError,
    "The relaxed cloth was not found: lengths or stiffnesses are too many orders of magnitude apart."
);

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Invalid { .. } => PyValueError::new_err(error.to_string()),
            Error::NotConverged { .. } => ConvergenceError::new_err(error.to_string()),
            Error::OutOfMemory { .. } => PyMemoryError::new_err(error.to_string()),
            Error::Stopped => PyKeyboardInterrupt::new_err("stopped"),
        }
    }
}

/// Runs `work` without the GIL on `threads` threads (`None`: one per processor), while this one
/// watches for signals and calls `progress(done)`; an exception from either stops the work and is
/// raised once it has ended. A panic of the work is raised as a `RuntimeError`.
///
/// The threads are made for this call: those of a pool kept from call to call would be missing in a
/// forked process.
pub fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Control) -> Result<T> + Send,
) -> PyResult<T> {
    let control = Control::default();
    let mut interruption = None;
    let result = thread::scope(|scope| {
        let (send, mut receive) = mpsc::sync_channel(1);
        let control = &control;
        let worker = scope.spawn(move || {
            let _ = send.send(on_threads(threads, || work(control)));
        });
        loop {
            // An exclusive borrow: a receiver may be sent to another thread, but not shared.
            let receive = &mut receive;
            match py.detach(move || receive.recv_timeout(WATCH_INTERVAL)) {
                Ok(result) => break result.map_err(PyErr::from),
                Err(RecvTimeoutError::Timeout) => {}
                // The sender is gone without an answer: the worker panicked.
                Err(RecvTimeoutError::Disconnected) => match worker.join() {
                    Err(panic) => break Err(fault(panic.as_ref())),
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
        None => result,
    }
}

/// The exception for a panic. Not PyO3's own, which no `except Exception` catches.
fn fault(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    PyRuntimeError::new_err(format!("a fault inside plycloth, please report it: {text}"))
}

fn on_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    pool.map_err(|error| Error::invalid("threads", error.to_string()))?.install(work)
}

fn watch(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>, control: &Control) -> PyResult<()> {
    py.check_signals()?;
    if let Some(report) = progress {
        report.call1((control.done(),))?;
    }
    Ok(())
}
