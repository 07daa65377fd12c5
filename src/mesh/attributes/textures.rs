//! A material made of pictures, such as those that `rtfmesh asset` bakes.

use serde_json::json;

use super::materials::{CLAMP, Image, Materials};

/// The pictures of one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Textures {
    /// Colours in sRGB, with opacity or without.
    pub base_colour: Image,
    /// Roughness in green and metalness in blue; the numbers below count without it.
    pub metallic_roughness: Option<Image>,
    /// Normals in the tangent space of the texture coordinates.
    pub normal: Option<Image>,
    /// Light given off, in sRGB.
    pub emissive: Option<Image>,
    /// 0 (dielectric) to 1 (metal).
    pub metallic: f64,
    /// 0 (smooth) to 1.
    pub roughness: f64,
    /// What the opacity of the base colour means.
    pub alpha: Alpha,
    /// Whether triangles are seen from behind as well.
    pub double_sided: bool,
}

/// What opacity means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alpha {
    /// Nothing.
    #[default]
    Opaque,
    /// What has less than a half is left out.
    Mask,
    /// It is mixed with what lies behind.
    Blend,
}

impl Materials {
    /// One material with pictures on the texture coordinates of its mesh.
    pub fn textured(textures: Textures) -> Self {
        let mut made = Self { samplers: vec![json!({ "wrapS": CLAMP, "wrapT": CLAMP })], ..Self::default() };
        let mut add = |image: Image| {
            let index = made.images.len();
            made.images.push(image);
            made.textures.push(json!({ "source": index, "sampler": 0 }));
            json!({ "index": index })
        };
        let Textures { base_colour, metallic_roughness, normal, emissive, .. } = textures;
        let mut surface = json!({ "baseColorTexture": add(base_colour) });
        let mut material = json!({});
        match metallic_roughness {
            Some(image) => surface["metallicRoughnessTexture"] = add(image),
            None => {
                surface["metallicFactor"] = json!(textures.metallic);
                surface["roughnessFactor"] = json!(textures.roughness);
            }
        }
        material["pbrMetallicRoughness"] = surface;
        if let Some(image) = normal {
            material["normalTexture"] = add(image);
        }
        if let Some(image) = emissive {
            material["emissiveTexture"] = add(image);
            material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
        }
        match textures.alpha {
            Alpha::Opaque => {}
            Alpha::Mask => material["alphaMode"] = json!("MASK"),
            Alpha::Blend => material["alphaMode"] = json!("BLEND"),
        }
        if textures.double_sided {
            material["doubleSided"] = json!(true);
        }
        made.materials.push(material);
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;
    use std::sync::Arc;

    #[test]
    fn pictures_are_numbered_in_order() {
        let image = |name: &str| Image {
            name: Some(name.to_owned()),
            mime: "image/png".to_owned(),
            bytes: Arc::from(name.as_bytes()),
        };
        let made = Materials::textured(Textures {
            base_colour: image("colour"),
            metallic_roughness: None,
            normal: Some(image("normal")),
            emissive: None,
            metallic: 0.0,
            roughness: 0.5,
            alpha: Alpha::Mask,
            double_sided: true,
        });
        let names: Vec<_> = made.images().iter().filter_map(|image| image.name.as_deref()).collect();
        assert_eq!(names, ["colour", "normal"]);
        let found: Value = serde_json::from_str(&made.to_json()).unwrap();
        let expected = json!({
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0, "roughnessFactor": 0.5,
            },
            "normalTexture": { "index": 1 },
            "alphaMode": "MASK",
            "doubleSided": true,
        });
        assert_eq!(found["materials"], json!([expected]));
        assert_eq!(found["textures"], json!([{ "source": 0, "sampler": 0 }, { "source": 1, "sampler": 0 }]));
    }
}
