//! What a Parquet file says of itself: the header of every page, and columns and row groups at its end. Field numbers are those
//! of <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift>.

use super::thrift::Struct;
use crate::recording::build;
use crate::recording::export::learn::{Column, Kind};

/// Physical types.
const BOOLEAN: i32 = 0;
const INT64: i32 = 2;
const DOUBLE: i32 = 5;
const BYTE_ARRAY: i32 = 6;

/// How values are encoded: one after the other, which every reader understands.
const PLAIN: i32 = 0;
/// How definition levels are: in runs.
const RLE: i32 = 3;
const ZSTD: i32 = 6;
/// A column may be null.
const OPTIONAL: i32 = 1;
/// What a text was called before there were logical types.
const UTF8: i32 = 0;
/// With page headers as they are here.
const VERSION: i32 = 1;

/// Some rows, column by column.
pub(super) struct RowGroup {
    pub rows: usize,
    pub chunks: Vec<Chunk>,
}

/// A column of a row group: one page, with its header.
pub(super) struct Chunk {
    /// Byte of the file at which it begins.
    pub start: usize,
    pub bytes: usize,
    pub uncompressed_bytes: usize,
}

/// What stands before a page.
pub(super) fn page_header(rows: usize, uncompressed_bytes: usize, bytes: usize) -> Vec<u8> {
    const DATA_PAGE: i32 = 0;
    let data = Struct::default().i32(1, rows as i32).i32(2, PLAIN).i32(3, RLE).i32(4, RLE);
    Struct::default().i32(1, DATA_PAGE).i32(2, uncompressed_bytes as i32).i32(3, bytes as i32).inner(5, data).finish()
}

/// What stands at the end of the file.
pub(super) fn footer(columns: &[Column], groups: &[RowGroup]) -> Vec<u8> {
    let root = Struct::default().text(4, "table").i32(5, columns.len() as i32);
    let schema: Vec<Struct> = std::iter::once(root).chain(columns.iter().map(element)).collect();
    Struct::default()
        .i32(1, VERSION)
        .structs(2, schema.into_iter())
        .i64(3, groups.iter().map(|group| group.rows).sum())
        .structs(4, groups.iter().map(|group| row_group(columns, group)))
        .text(6, &format!("flexcrank version {}", build::VERSION))
        .finish()
}

/// A column's name and type.
fn element(column: &Column) -> Struct {
    let element = Struct::default().i32(1, physical(column.kind)).i32(3, OPTIONAL).text(4, &column.name);
    match column.kind {
        Kind::Integer | Kind::Number | Kind::Flag => element,
        Kind::Text => {
            let string = Struct::default().inner(1, Struct::default());
            element.i32(6, UTF8).inner(10, string)
        }
        Kind::Time => {
            let nanoseconds = Struct::default().inner(3, Struct::default());
            let utc = Struct::default().yes(1).inner(2, nanoseconds);
            element.inner(10, Struct::default().inner(8, utc))
        }
    }
}

fn physical(kind: Kind) -> i32 {
    match kind {
        Kind::Integer | Kind::Time => INT64,
        Kind::Number => DOUBLE,
        Kind::Flag => BOOLEAN,
        Kind::Text => BYTE_ARRAY,
    }
}

fn row_group(columns: &[Column], group: &RowGroup) -> Struct {
    let total = group.chunks.iter().map(|chunk| chunk.uncompressed_bytes).sum();
    let chunks = group.chunks.iter().zip(columns).map(|(chunk, column)| {
        let about = Struct::default()
            .i32(1, physical(column.kind))
            .numbers(2, &[PLAIN, RLE])
            .texts(3, &[&column.name])
            .i32(4, ZSTD)
            .i64(5, group.rows)
            .i64(6, chunk.uncompressed_bytes)
            .i64(7, chunk.bytes)
            .i64(9, chunk.start);
        Struct::default().i64(2, chunk.start).inner(3, about)
    });
    Struct::default().structs(1, chunks).i64(2, total).i64(3, group.rows)
}
