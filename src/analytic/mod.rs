//! Closed forms: what a pixel or a point must see, without sampling.
