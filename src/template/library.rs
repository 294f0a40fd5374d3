//! The template library: templates found by their full key, or a cyclic rotation of it.

use super::Template;
use crate::ids::TemplateId;
use crate::mesh::StitchType;
use std::collections::{HashMap, HashSet};

/// Templates by key. Later definitions of a key replace earlier ones.
#[derive(Clone, Debug, Default)]
pub struct TemplateLibrary {
    templates: Vec<Template>,
    by_key: HashMap<String, TemplateId>,
    stand_ins: HashSet<TemplateId>,
}

impl TemplateLibrary {
    /// Adds a template; the last of a key wins.
    pub fn insert(&mut self, template: Template) {
        let key = template.key();
        match self.by_key.get(&key) {
            Some(id) => {
                self.stand_ins.remove(id);
                self.templates[id.index()] = template;
            }
            None => {
                self.by_key.insert(key, TemplateId::from(self.templates.len()));
                self.templates.push(template);
            }
        }
    }

    /// Makes all templates so far stand-ins: they serve what templates added later lack, as long as their
    /// yarn is as thick.
    pub fn stand_in(&mut self) {
        self.stand_ins = (0..self.templates.len()).map(TemplateId::from).collect();
    }

    /// Whether a template is a stand-in.
    pub fn stands_in(&self, id: TemplateId) -> bool {
        self.stand_ins.contains(&id)
    }

    /// All templates, in order of first definition.
    pub fn templates(&self) -> &[Template] {
        &self.templates
    }

    /// A template.
    pub fn get(&self, id: TemplateId) -> &Template {
        &self.templates[id.index()]
    }

    /// Finds the template of a stitch type: by its exact key, else by the first cyclic rotation of its
    /// labels that has one. Returns the rotation k: corner 0 of the template is corner k of the face.
    pub fn find(&self, stitch: &StitchType) -> Option<(TemplateId, usize)> {
        let n = stitch.labels.len();
        (0..n).find_map(|k| {
            let labels = (0..n).map(|i| stitch.labels[(i + k) % n].clone()).collect();
            let key = StitchType { name: stitch.name.clone(), labels }.key();
            self.by_key.get(&key).map(|id| (*id, k))
        })
    }

    /// Templates of that name, in library order.
    pub fn by_name(&self, name: &str) -> impl Iterator<Item = &Template> {
        self.templates.iter().filter(move |t| t.name == name)
    }

    /// The template of a full key.
    pub fn by_key(&self, key: &str) -> Option<&Template> {
        self.by_key.get(key).map(|id| self.get(*id))
    }
}
