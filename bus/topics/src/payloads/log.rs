//! What the services say in words: `log/thought` (G9).

use crate::role::Role;
use crate::schema::payload;
use crate::tag::Tag;
use crate::text::Text;

payload! {
    /// One sentence for a person to read.
    pub struct Thought: 122 bytes {
        /// The sentence.
        pub text: Text<120>,
        /// Who says it.
        pub from: Tag<Role>,
    }
}
