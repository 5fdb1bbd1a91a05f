//! Standard output that outlives its reader.

use serde::Serialize;
use std::io::{self, ErrorKind, Stdout, Write};

/// Standard output. Once its reader has closed it, as `head` does, output is dropped: the work goes on, and its exit code counts.
pub(super) fn output() -> Output {
    Output(io::stdout())
}

/// See [`output`].
pub(super) struct Output(Stdout);

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        unless_closed(self.0.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.0.flush(), ())
    }
}

fn unless_closed<T>(written: io::Result<T>, dropped: T) -> io::Result<T> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(dropped),
        written => written,
    }
}

/// Prints a value as one line of JSON.
pub(super) fn print_json(value: &impl Serialize) -> io::Result<()> {
    writeln!(output(), "{}", serde_json::to_string(value)?)
}
