//! The light transport loop.
