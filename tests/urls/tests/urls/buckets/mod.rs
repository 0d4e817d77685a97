//! Files in buckets of servers that require a key. Keys are in the environment, as users of those
//! services set them, so each file is opened by a separate process.

mod az;
mod gs;
mod opened;
mod s3;
