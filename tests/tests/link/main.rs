//! The link between host and device: faults, hostile ends, USB, late tiles.

mod fallback;
mod foreign_image;
mod hostile_device;
mod link_campaign;
mod link_faults;
mod link_model;
mod usb;
mod wiring;
