//! Ray queries: the tree over triangles, closest hit and occlusion.
