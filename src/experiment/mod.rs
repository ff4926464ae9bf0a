//! Experiments: from a JSON file to rows of results, resumable.
//!
//! | step | module | nature |
//! |---|---|---|
//! | read a file | [`spec`] | strict, pure data |
//! | list the work | [`plan`] | pure: ids and seeds come from content |
//! | let a reference grow | [`growth`] | pure: the rule and its reasons |
//! | say what is left and what it costs | [`survey`] | reads the output folder |
//! | do it | [`execute`] | the only slow stage; can be stopped at any moment, or cut into [`shards`] |
//! | rows | [`results`] | typed lines of `results.jsonl` |
//! | join shards | [`merge`] | renders nothing, opens no scene |
//! | say what is done, missing or stale | [`status`], [`why`] | reads the output folder |

mod about;
pub mod backend;
mod compared;
mod entry;
pub mod exact;
pub mod execute;
pub mod folder;
pub mod growth;
pub mod identity;
mod images;
pub mod lab;
mod lines;
pub mod machine;
mod measure;
pub mod merge;
pub mod origin;
pub mod peers;
mod pictures;
mod pixels;
pub mod plan;
pub mod prediction;
pub mod progress;
pub mod results;
pub mod shards;
pub mod spec;
pub mod status;
mod superseded;
pub mod survey;
pub mod timing;
pub mod variant;
pub mod why;
