//! Files in buckets of servers that ask for a key. Keys come as the users of those services
//! give them, in the environment: so each file is opened by a process of its own.

mod az;
mod gs;
mod opened;
mod s3;
