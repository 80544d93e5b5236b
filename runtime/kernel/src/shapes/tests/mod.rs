//! The intersectors against the signed distances, each other, and closed forms.
mod extremes;
mod harness;
mod random_rays;
mod seams;
mod units;
mod volumes;
