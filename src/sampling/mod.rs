//! Sample points: sets, orders, randomisations, and who reads which numbers.
