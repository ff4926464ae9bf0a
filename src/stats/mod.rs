//! Statistics: discrepancies, moments, image errors, fits and tests.
