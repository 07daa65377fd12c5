//! Reads a kernel's bindings, push constants and specialization constants from its SPIR-V.

use crate::module::{OP_DECORATE, OP_NAME, OP_SPEC_CONSTANT, instructions};
use spirq::prelude::*;
use spirq::ty::ScalarType;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// One storage buffer of a kernel.
pub struct Binding {
    pub name: String,
    pub index: u32,
    pub element: &'static str,
    pub access: &'static str,
    /// Whether it can be a texel buffer.
    pub texels: bool,
}

/// One member of the push-constant block.
pub struct PushMember {
    pub name: String,
    pub offset: usize,
    pub ty: &'static str,
}

/// One specialization constant with its default.
pub struct Constant {
    pub name: String,
    pub id: u32,
    pub default: u32,
}

/// Everything that the generated declaration of a kernel needs.
pub struct Kernel {
    pub stage: String,
    pub stem: String,
    pub spirv: Vec<u32>,
    /// As it reads vectors from texel buffers, if it can.
    pub texel_spirv: Option<Vec<u32>>,
    pub bindings: Vec<Binding>,
    pub push: Vec<PushMember>,
    pub constants: Vec<Constant>,
}

impl Kernel {
    /// The dotted name, `stage.kernel`.
    pub fn name(&self) -> String {
        format!("{}.{}", self.stage, self.stem)
    }
}

/// Reflects `spirv`; refuses what the recorder cannot bind and types without a Rust equivalent.
pub fn reflect(file: &Path, spirv: Vec<u32>) -> Result<Kernel, String> {
    let at = |problem: &str| format!("{}: {problem}", file.display());
    let entry = ReflectConfig::new()
        .spv(spirv.as_slice())
        .ref_all_rscs(true)
        .reflect()
        .map_err(|e| at(&format!("reflection failed: {e}")))?
        .pop()
        .ok_or_else(|| at("no entry point"))?;
    let defaults = specialization_defaults(&spirv);
    let (mut bindings, mut push, mut constants) = (Vec::new(), Vec::new(), Vec::new());
    for var in &entry.vars {
        match var {
            Variable::Descriptor { desc_bind, desc_ty, ty, .. } => {
                bindings.push(binding(desc_bind, desc_ty, ty).map_err(|e| at(&e))?);
            }
            Variable::PushConstant { ty, .. } => push = push_members(ty).map_err(|e| at(&e))?,
            // The local size has a second, nameless constant with id 0.
            Variable::SpecConstant { name: Some(name), spec_id, .. } => constants.push(Constant {
                name: name.to_lowercase(),
                id: *spec_id,
                default: *defaults
                    .get(spec_id)
                    .ok_or_else(|| at("a specialization constant that is not a uint"))?,
            }),
            _ => {}
        }
    }
    bindings.sort_by_key(|b: &Binding| b.index);
    constants.sort_by_key(|c: &Constant| c.id);
    if bindings.iter().enumerate().any(|(i, b)| b.index != i as u32) {
        return Err(at("bindings must be numbered 0, 1, 2, … in set 0"));
    }
    if constants.first().is_none_or(|c| c.id != 0 || c.name != "workgroup") {
        return Err(at("specialization constant 0 must be WORKGROUP, the local size"));
    }
    let text = |part: Option<&std::ffi::OsStr>| part.and_then(|s| s.to_str()).map(str::to_owned);
    let stem = text(file.file_stem()).ok_or_else(|| at("not a UTF-8 name"))?;
    let stage = text(file.parent().and_then(Path::file_name)).ok_or_else(|| at("not in a stage folder"))?;
    Ok(Kernel { stage, stem, spirv, texel_spirv: None, bindings, push, constants })
}

/// Marks the bindings that are texel buffers in `spirv`; whether there are any.
pub fn mark_texels(file: &Path, kernel: &mut Kernel, spirv: &[u32]) -> Result<bool, String> {
    let at = |problem: &str| format!("{}: {problem}", file.display());
    let reflected = ReflectConfig::new().spv(spirv).ref_all_rscs(true).reflect();
    let entry = reflected.map_err(|e| at(&format!("reflection failed: {e}")))?.pop();
    for var in entry.ok_or_else(|| at("no entry point"))?.vars {
        let Variable::Descriptor { desc_bind, desc_ty: DescriptorType::UniformTexelBuffer(), .. } = var
        else {
            continue;
        };
        let binding = kernel.bindings.get_mut(desc_bind.bind() as usize);
        let binding = binding.filter(|b| b.element.contains("Vec") && b.access == "Read");
        binding.ok_or_else(|| at("only vectors that are read can be texels"))?.texels = true;
    }
    Ok(kernel.bindings.iter().any(|b| b.texels))
}

fn binding(place: &DescriptorBinding, kind: &DescriptorType, ty: &Type) -> Result<Binding, String> {
    let DescriptorType::StorageBuffer(access) = kind else {
        return Err("only storage buffers can be bound".to_owned());
    };
    let members = match ty {
        Type::Struct(block) if place.set() == 0 => &block.members,
        _ => return Err(format!("binding {place} is not a block in set 0")),
    };
    let [member] = members.as_slice() else {
        return Err(format!("the block at {place} must hold one array"));
    };
    let (Some(name), Type::Array(array)) = (&member.name, &member.ty) else {
        return Err(format!("the block at {place} must hold one named array"));
    };
    let element =
        rust_type(&array.element_ty).ok_or_else(|| format!("'{name}': no Rust type for its elements"))?;
    let access = match *access & member.access_ty {
        Some(AccessType::ReadOnly) => "Read",
        Some(AccessType::WriteOnly) => "Write",
        _ => "ReadWrite",
    };
    Ok(Binding { name: name.clone(), index: place.bind(), element, access, texels: false })
}

fn push_members(ty: &Type) -> Result<Vec<PushMember>, String> {
    let Type::Struct(block) = ty else { return Err("the push constants are not a block".to_owned()) };
    block
        .members
        .iter()
        .map(|m| match (&m.name, m.offset, rust_type(&m.ty)) {
            (Some(name), Some(offset), Some(ty)) => Ok(PushMember { name: name.clone(), offset, ty }),
            (name, ..) => Err(format!("push constant {name:?} has no Rust type")),
        })
        .collect()
}

/// The `Pod` type with the same std430 layout; three-component vectors have none.
fn rust_type(ty: &Type) -> Option<&'static str> {
    const F32: ScalarType = ScalarType::Float { bits: 32 };
    const U32: ScalarType = ScalarType::Integer { bits: 32, is_signed: false };
    Some(match ty {
        Type::Scalar(s) if *s == F32 => "f32",
        Type::Scalar(s) if *s == U32 => "u32",
        Type::Vector(v) if v.scalar_ty == F32 && v.nscalar == 2 => "Vec2",
        Type::Vector(v) if v.scalar_ty == F32 && v.nscalar == 4 => "Vec4",
        Type::Vector(v) if v.scalar_ty == U32 && v.nscalar == 2 => "UVec2",
        Type::Vector(v) if v.scalar_ty == U32 && v.nscalar == 4 => "UVec4",
        _ => return None,
    })
}

/// Default values by specialization id: spirq reports names and ids only. Constants without a name do not
/// count: the local size has one, with the id of WORKGROUP and a default of 1.
fn specialization_defaults(spirv: &[u32]) -> HashMap<u32, u32> {
    const DECORATION_SPEC_ID: u32 = 1;
    let (mut ids, mut values, mut named) = (HashMap::new(), HashMap::new(), HashSet::new());
    for (op, instruction) in instructions(spirv) {
        match (op, instruction) {
            (OP_NAME, &[_, target, ..]) => drop(named.insert(target)),
            (OP_SPEC_CONSTANT, &[_, _, result, value]) => drop(values.insert(result, value)),
            (OP_DECORATE, &[_, target, DECORATION_SPEC_ID, id]) => drop(ids.insert(target, id)),
            _ => {}
        }
    }
    ids.retain(|target, _| named.contains(target));
    ids.into_iter().filter_map(|(target, id)| Some((id, *values.get(&target)?))).collect()
}
