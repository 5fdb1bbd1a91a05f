//! NumPy's `.npz`: arrays as `.npy` files in a ZIP archive, stored as they are.

use crc32fast::hash;

/// Length of `.npy`'s magic number, version and header length.
const PREAMBLE: usize = 10;
/// The data of a `.npy` file begin at a multiple of this.
const ALIGNED: usize = 64;
/// Version 2.0 of ZIP, and the first day that it knows, 1 January 1980: the same arrays give the same bytes.
const VERSION: u16 = 20;
const DATE: u16 = 0x21;

/// An archive in the making.
#[derive(Default)]
pub(super) struct Npz {
    files: Vec<u8>,
    directory: Vec<u8>,
    count: u16,
}

impl Npz {
    /// Adds an array of numbers, row by row.
    pub(super) fn numbers(&mut self, name: &str, shape: &[usize], numbers: impl Iterator<Item = f64>) {
        self.array(name, "<f8", shape, numbers.flat_map(f64::to_le_bytes).collect());
    }

    /// Adds an array of words.
    pub(super) fn words(&mut self, name: &str, words: &[String]) {
        let longest = words.iter().map(|word| word.chars().count()).max().unwrap_or(0).max(1);
        let padded = |word: &String| word.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest).collect::<Vec<u32>>();
        let bytes = words.iter().flat_map(padded).flat_map(u32::to_le_bytes).collect();
        self.array(name, &format!("<U{longest}"), &[words.len()], bytes);
    }

    /// The whole archive.
    pub(super) fn finish(self) -> Vec<u8> {
        let Npz { files, directory, count } = self;
        let mut end = b"PK\x05\x06\0\0\0\0".to_vec();
        end.extend([count, count].map(u16::to_le_bytes).concat());
        end.extend([length(&directory), length(&files)].map(u32::to_le_bytes).concat());
        end.extend([0, 0]);
        [files, directory, end].concat()
    }

    /// Version 1.0 of the format: magic number, length of the header, header, data.
    fn array(&mut self, name: &str, kind: &str, shape: &[usize], bytes: Vec<u8>) {
        // A tuple of one has a comma, too.
        let shape: String = shape.iter().map(|length| format!("{length}, ")).collect();
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        let whole = (PREAMBLE + header.len() + 1).next_multiple_of(ALIGNED) - PREAMBLE;
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((whole as u16).to_le_bytes());
        file.extend(format!("{header:<width$}\n", width = whole - 1).bytes());
        file.extend(bytes);
        self.file(&format!("{name}.npy"), &file);
    }

    /// The file with its header, and its entry in the directory (APPNOTE.TXT, 4.3.7 and 4.3.12).
    fn file(&mut self, name: &str, bytes: &[u8]) {
        let (offset, size) = (length(&self.files), length(bytes));
        let mut common = [VERSION, 0, 0, 0, DATE].map(u16::to_le_bytes).concat();
        common.extend([hash(bytes), size, size].map(u32::to_le_bytes).concat());
        common.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
        self.files.extend([b"PK\x03\x04", &common[..], name.as_bytes(), bytes].concat());
        self.directory.extend([b"PK\x01\x02", &VERSION.to_le_bytes()[..], &common[..]].concat());
        // No comment, first disk, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend([&offset.to_le_bytes()[..], name.as_bytes()].concat());
        self.count += 1;
    }
}

/// At most 2000 states make some 100 MB.
fn length(bytes: &[u8]) -> u32 {
    bytes.len() as u32
}
