//! Which instruction sets this CPU has, and the way into them.
use super::Isa;
use super::portable::Portable;

/// A set of vector instructions that the kernel is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// x86-64 with AVX-512 F, VL, DQ, BW: 16 f32 or 8 f64.
    Avx512,
    /// x86-64 with AVX2 and FMA: 8 f32 or 4 f64.
    Avx2,
    /// AArch64: 4 f32 or 2 f64.
    Neon,
    /// Arrays of scalars: 4 f32 or 2 f64.
    Portable,
}

impl InstructionSet {
    const ALL: [InstructionSet; 4] = [Self::Avx512, Self::Avx2, Self::Neon, Self::Portable];

    /// What this CPU can run, best first; the last is [`InstructionSet::Portable`].
    pub fn available() -> Vec<InstructionSet> {
        Self::ALL
            .into_iter()
            .filter(|set| set.is_available())
            .collect()
    }

    /// Whether this CPU can run it, and this build has it.
    pub fn is_available(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("popcnt")
                    && Self::Avx2.is_available()
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => std::arch::is_aarch64_feature_detected!("neon"),
            Self::Portable => true,
            #[allow(unreachable_patterns)]
            _ => false,
        }
    }

    /// `avx512`, `avx2`, `neon` or `portable`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Neon => "neon",
            Self::Portable => "portable",
        }
    }

    /// The set of that [`name`](Self::name), whether or not this CPU has it.
    pub fn from_name(name: &str) -> Option<InstructionSet> {
        Self::ALL.into_iter().find(|set| set.name() == name)
    }
}

/// Work that is written for any instruction set.
pub trait Task {
    /// What comes of it.
    type Output;
    /// Does it. Must be `#[inline(always)]`, as everything it calls: what is not inlined is not
    /// compiled for the set.
    fn run<I: Isa>(self) -> Self::Output;
}

/// Runs a task on an instruction set. Panics if this CPU does not have it.
pub fn dispatch<T: Task>(set: InstructionSet, task: T) -> T::Output {
    assert!(set.is_available(), "this CPU cannot run {}", set.name());
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => super::avx512::Avx512::call(task),
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => super::avx2::Avx2::call(task),
        #[cfg(target_arch = "aarch64")]
        InstructionSet::Neon => super::neon::Neon::call(task),
        _ => Portable::call(task),
    }
}
