//! Terrain at URLs: ranges, redirects, buckets, caches, faults of servers.

mod buckets;
mod faults;
mod prefetch;
mod ranges;
mod redirects;
mod second_run;
mod served;
