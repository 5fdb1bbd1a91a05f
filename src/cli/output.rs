//! Standard output and standard error: control characters are escaped, and both outlive their reader.

use serde::Serialize;
use std::io::{self, ErrorKind, Stderr, Stdout, Write};

/// Standard output, in which control characters of foreign texts (names in a recording) are escaped. Once its reader has closed it, as
/// `head` does, output is dropped: the work goes on, and its exit code counts. Names that may hold a line break are printed by
/// [`shown_name`](crate::shown::shown_name).
pub(super) fn output() -> Output<Stdout> {
    Output { to: io::stdout(), named: of_standard_output }
}

/// Standard error, like [`output`].
pub(super) fn messages() -> Output<Stderr> {
    Output { to: io::stderr(), named: |error| error }
}

/// An error of standard output that says so.
pub(super) fn of_standard_output(error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("standard output: {error}"))
}

/// See [`output`].
pub(super) struct Output<W> {
    to: W,
    /// Adds its name to an error.
    named: fn(io::Error) -> io::Error,
}

impl<W: Write> Write for Output<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let is_plain = |byte: &u8| !byte.is_ascii_control() || matches!(byte, b'\n' | b'\t');
        if bytes.iter().all(is_plain) {
            return unless_closed(self.to.write(bytes), bytes.len()).map_err(self.named);
        }
        for part in bytes.chunk_by(|a, b| is_plain(a) == is_plain(b)) {
            let plain = part.iter().all(is_plain);
            let escaped = if plain { part.to_vec() } else { part.escape_ascii().to_string().into_bytes() };
            unless_closed(self.to.write_all(&escaped), ()).map_err(self.named)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.to.flush(), ()).map_err(self.named)
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
