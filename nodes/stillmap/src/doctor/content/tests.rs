//! Readings one by one; whole bags are in the tests of the whole.
