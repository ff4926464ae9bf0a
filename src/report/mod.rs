//! Reports: figures, tables and sentences out of rows.
