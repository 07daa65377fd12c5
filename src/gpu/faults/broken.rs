//! Drivers that leave commands out, or compile a kernel wrongly, and report no error.

use super::{PLAN, Pointer};
use crate::gpu::device::lock;
use crate::gpu::kernel::KernelInfo;
use ash::vk;
use std::ffi::CStr;
use std::slice;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is wrong with the code of a kernel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Miscompiled {
    pub kernel: &'static KernelInfo,
    pub wrong: Wrong,
}

/// All instructions of one kind compute something else; numbers are those of SPIR-V.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wrong {
    /// Another instruction of the same form.
    Instruction(u32, u32),
    /// Another function of GLSL.
    Function(u32, u32),
    /// A word of an instruction: which, and what it is.
    Word(u32, usize, u32),
    /// An instruction without its last word.
    Shorter(u32, u32),
    /// An instruction is left out.
    Nothing(u32),
}

const NOP: u32 = 1 << 16;
/// `OpExtInst`, and where it has the number of the function.
const FUNCTION: u32 = 12;
const FUNCTION_AT: usize = 4;
/// Words before the first instruction.
const HEADER: usize = 5;

impl Wrong {
    /// The code with this fault, and how many instructions are wrong.
    pub fn apply(self, code: &[u32]) -> (Vec<u32>, usize) {
        let mut code = code.to_vec();
        let (mut at, mut count) = (HEADER, 0);
        while at < code.len() {
            let (length, number) = ((code[at] >> 16) as usize, code[at] & 0xffff);
            let instruction = &mut code[at..at + length];
            let applies = match self {
                Self::Function(from, _) => number == FUNCTION && instruction[FUNCTION_AT] == from,
                Self::Instruction(from, _)
                | Self::Word(from, ..)
                | Self::Shorter(from, _)
                | Self::Nothing(from) => number == from,
            };
            if applies {
                count += 1;
                match self {
                    Self::Instruction(_, to) => instruction[0] = (instruction[0] & !0xffff) | to,
                    Self::Function(_, to) => instruction[FUNCTION_AT] = to,
                    Self::Word(_, place, to) => instruction[place] = to,
                    Self::Shorter(_, to) => {
                        instruction[0] = ((length as u32 - 1) << 16) | to;
                        instruction[length - 1] = NOP;
                    }
                    Self::Nothing(_) => instruction.fill(NOP),
                }
            }
            at += length;
        }
        (code, count)
    }
}

/// The faults' command `found` of this name, or one that breaks it first.
pub(super) fn shim(name: &CStr, found: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
    if name == c"vkCreateShaderModule" {
        COMPILER.store(found? as usize, Ordering::Relaxed);
        // SAFETY: both are function pointers; the caller casts this one to what the name says.
        return unsafe { std::mem::transmute::<Compiler, vk::PFN_vkVoidFunction>(create_shader_module) };
    }
    left_out(name, found)
}

type Compiler = unsafe extern "system" fn(
    vk::Device,
    *const vk::ShaderModuleCreateInfo<'_>,
    Pointer,
    *mut vk::ShaderModule,
) -> vk::Result;

static COMPILER: AtomicUsize = AtomicUsize::new(0);

unsafe extern "system" fn create_shader_module(
    device: vk::Device,
    info: *const vk::ShaderModuleCreateInfo<'_>,
    allocator: Pointer,
    module: *mut vk::ShaderModule,
) -> vk::Result {
    let miscompiled = lock(&PLAN).miscompiled;
    // SAFETY: the address was stored before this function was given out; the caller keeps the command's
    // contract, so that the info is valid, and its code as long as it says.
    unsafe {
        let real: Compiler = std::mem::transmute(COMPILER.load(Ordering::Relaxed));
        let code = slice::from_raw_parts((*info).p_code, (*info).code_size / 4);
        let is_of = |spirv: &[u8]| bytemuck::cast_slice::<u32, u8>(code) == spirv;
        let wrong = miscompiled.filter(|m| is_of(m.kernel.spirv) || is_of(m.kernel.texel_spirv));
        let Some(wrong) = wrong else { return real(device, info, allocator, module) };
        let (code, count) = wrong.wrong.apply(code);
        lock(&PLAN).wrong_instructions += count;
        real(device, &(*info).code(&code), allocator, module)
    }
}

/// Commands without a result, which the plan may leave out.
macro_rules! commands {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        fn left_out(name: &CStr, found: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
            $(
                if name.to_bytes() == stringify!($name).as_bytes() {
                    $name::REAL.store(found? as usize, Ordering::Relaxed);
                    // SAFETY: both are function pointers; the caller casts this one to what the name says.
                    return unsafe {
                        std::mem::transmute::<$name::Command, vk::PFN_vkVoidFunction>($name::shim)
                    };
                }
            )*
            found
        }

        $(
            #[allow(non_snake_case, reason = "it is Vulkan's name")]
            mod $name {
                use super::*;

                pub type Command = unsafe extern "system" fn($($type),*);
                pub static REAL: AtomicUsize = AtomicUsize::new(0);

                pub unsafe extern "system" fn shim($($argument: $type),*) {
                    if lock(&PLAN).left_out.contains(&stringify!($name)) {
                        return;
                    }
                    // SAFETY: the address was stored before this function was given out; the caller keeps the
                    // command's contract.
                    unsafe {
                        let real: Command = std::mem::transmute(REAL.load(Ordering::Relaxed));
                        real($($argument),*);
                    }
                }
            }
        )*
    };
}

commands! {
    vkCmdDispatch(commands: Pointer, x: u32, y: u32, z: u32);
    vkCmdDispatchBase(commands: Pointer, at_x: u32, at_y: u32, at_z: u32, x: u32, y: u32, z: u32);
    vkCmdDispatchIndirect(commands: Pointer, buffer: u64, offset: u64);
    vkCmdCopyBuffer(commands: Pointer, from: u64, to: u64, count: u32, regions: Pointer);
}
