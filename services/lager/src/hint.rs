//! Adds to a reason the command that helps. A page has buttons where a terminal has commands, so
//! the shared sentences name no commands. Neither do the errors of the bus, which applications
//! without `lager` use, too.

use lager_home::HomeError;
use lager_orders::Reason;
use lager_ports::{OpenError, PortError};

use crate::exit::port_error;

/// The error as a sentence, with the command or flag that helps where there is one.
pub fn helped(error: &anyhow::Error) -> String {
    let hint = error.chain().find_map(|cause| {
        if let Some(PortError::TooManyObservers { topic, .. }) = port_error(cause) {
            return Some(format!("`lager topic info {topic}` lists them"));
        }
        let is_folder =
            cause.is::<HomeError>() || matches!(cause.downcast_ref(), Some(OpenError::Home(_)));
        is_folder.then(|| "`--bus` names another folder".to_owned())
    });
    match hint {
        Some(hint) => format!("{error:#}; {hint}"),
        None => format!("{error:#}"),
    }
}

/// The reason as a sentence, with the command that helps where there is one.
pub fn hinted(why: impl Into<Reason>) -> String {
    let why = why.into();
    let code = match why.code() {
        // The reason itself stands behind the name of the command.
        "not_possible" | "refused" => why.as_str().split(' ').nth(2).unwrap_or_default(),
        code => code,
    };
    match hint(code) {
        Some(hint) => format!("{why}; {hint}"),
        None => why.to_string(),
    }
}

fn hint(code: &str) -> Option<&'static str> {
    Some(match code {
        "refusal_not_in_charge" => "`lager mode manual` lets you drive",
        "refusal_stop_latched" | "stopped" => "`lager resume` releases the stop",
        "refusal_no_board" | "calibration_broken" => "`lager doctor` looks for the cause",
        "outcome_no_board" => "`lager topic echo link/health` shows the links",
        "outcome_under_way" | "moving" => "`lager mode manual` or `lager stop` does",
        "order_unknown" => "`lager queue` shows those that do",
        "world_robot_there" => "`lager stop` stops it",
        "world_nothing_there" => "`lager obstacle` lists what stands",
        "world_full" => "`lager obstacle take` does",
        "failure_goods_delivered" | "failure_goods_away" => "`lager map back` says so",
        "failure_servo_silent" => "with the robot down, `lager doctor` names all of them",
        "logic_silent" | "order_untaken" => "is the robot up? (`lager up`)",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use lager_monitor::ToolError;
    use lager_orders::Code;
    use lager_topics::Refusal;

    use super::*;

    #[test]
    fn an_error_of_the_bus_is_followed_by_the_command_that_helps() {
        let full = PortError::TooManyObservers {
            topic: "sensor/line".into(),
            limit: 64,
        };
        let relative = HomeError::RelativeFolder("here".into());
        for (error, hint) in [
            (
                full.clone().into(),
                "; `lager topic info sensor/line` lists them",
            ),
            (
                ToolError::Open(full).into(),
                "; `lager topic info sensor/line` lists them",
            ),
            (
                OpenError::Home(relative.clone()).into(),
                "; `--bus` names another folder",
            ),
            (relative.into(), "; `--bus` names another folder"),
            (OpenError::Speed(0.0).into(), "give a positive number"),
        ] {
            let said = helped(&error);
            assert!(said.ends_with(hint), "{said}");
        }
    }

    #[test]
    fn a_reason_within_a_reason_has_its_command_too() {
        let inner = Reason::from(Refusal::NoBoard);
        let outer = Reason::new(Code::NotPossible, &[&"forward", &inner.as_str()]);
        let said = hinted(outer);
        assert!(
            said.ends_with("; `lager doctor` looks for the cause"),
            "{said}"
        );
    }
}
