//! [`Tells`]: how the tools open a topic at a place, and the tools that do so at any of them.

use std::io::Write;

use lager_ports::Bus;
use lager_topics::visit;

use crate::echo::{Echo, EchoConfig};
use crate::measure::{Gauge, Measure, Plan};
use crate::place::Place;
use crate::{ToolError, Tools};

/// A place whose topics can be opened by their names.
pub trait Tells: Place + Sized {
    /// Opens a topic, and shows its samples.
    ///
    /// # Errors
    /// As [`Tools::echo`].
    #[doc(hidden)]
    fn echo<W: Write>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        config: &EchoConfig,
    ) -> Result<(), ToolError>;

    /// Opens a topic, and measures it.
    ///
    /// # Errors
    /// As [`Tools::hz`].
    #[doc(hidden)]
    #[allow(
        private_interfaces,
        private_bounds,
        reason = "only this crate's tools call it"
    )]
    fn measure<W: Write, G: Gauge, F: Fn(usize) -> G>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        plan: Plan<F>,
    ) -> Result<(), ToolError>;
}

impl Tells for Bus {
    fn echo<W: Write>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        config: &EchoConfig,
    ) -> Result<(), ToolError> {
        match visit(name, Echo { tools, config }) {
            Ok(echoed) => echoed,
            Err(unknown) => {
                let found = tools.found(name, unknown)?;
                tools.echo_found(name, found, config)
            }
        }
    }

    #[allow(private_interfaces, private_bounds, reason = "as above")]
    fn measure<W: Write, G: Gauge, F: Fn(usize) -> G>(
        tools: &mut Tools<'_, W, Self>,
        name: &str,
        plan: Plan<F>,
    ) -> Result<(), ToolError> {
        match visit(name, Measure { tools, plan: &plan }) {
            Ok(measured) => measured,
            Err(unknown) => {
                let found = tools.found(name, unknown)?;
                let size = found.description().size();
                tools.measure_from(name, size, found, &plan)
            }
        }
    }
}

impl<W: Write, P: Tells> Tools<'_, W, P> {
    /// `topic echo`: each sample of `name`, or some of its fields, until a limit or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, its samples have no such field, it cannot be read, or the output
    /// cannot be written.
    pub fn echo(&mut self, name: &str, config: &EchoConfig) -> Result<(), ToolError> {
        P::echo(self, name, config)
    }

    pub(crate) fn measure<G: Gauge, F: Fn(usize) -> G>(
        &mut self,
        name: &str,
        plan: Plan<F>,
    ) -> Result<(), ToolError> {
        P::measure(self, name, plan)
    }
}
