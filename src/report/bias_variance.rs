//! Speed against accuracy.
