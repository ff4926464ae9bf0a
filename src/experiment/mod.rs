//! Experiments: from a JSON file to rows of results, resumable.
