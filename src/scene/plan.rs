//! What a scene requires, and what is therefore modelled.

/// One decision and its reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanEntry {
    /// What is decided on.
    pub subject: &'static str,
    /// What is done about it.
    pub decision: String,
    /// Why.
    pub reason: String,
}

/// The decisions made when the scene was compiled, in the order they were made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    pub entries: Vec<PlanEntry>,
}

impl Plan {
    pub fn add(
        &mut self,
        subject: &'static str,
        decision: impl Into<String>,
        reason: impl Into<String>,
    ) {
        self.entries.push(PlanEntry {
            subject,
            decision: decision.into(),
            reason: reason.into(),
        });
    }
}
