//! The intersectors against the signed distances, each other, and closed forms.
mod harness;
mod random_rays;
