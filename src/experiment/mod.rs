//! Experiments: from a JSON file to rows of results, resumable.
//!
//! | step | module | nature |
//! |---|---|---|
//! | read a file | [`spec`] | strict, pure data |
//! | list the work | [`plan`] | pure: ids and seeds come from content |
//! | say what is left and what it costs | [`survey`] | reads the output folder |
//! | do it | [`execute`] | the only slow stage; can be stopped at any moment |
//! | rows | [`results`] | typed lines of `results.jsonl` |

pub mod backend;
mod compared;
mod entry;
mod exact;
pub mod execute;
pub mod identity;
mod images;
pub mod lab;
mod machine;
mod measure;
mod pictures;
pub mod plan;
pub mod progress;
pub mod results;
pub mod spec;
pub mod survey;
pub mod variant;
