//! Adds to a reason the command that helps. A page has buttons where a terminal has commands, so
//! the shared sentences name no commands.

use lager_orders::Reason;

/// The reason as a sentence, with the command that helps where there is one.
pub fn hinted(why: impl Into<Reason>) -> String {
    let why = why.into();
    match hint(why.code()) {
        Some(hint) => format!("{why}; {hint}"),
        None => why.to_string(),
    }
}

fn hint(code: &str) -> Option<&'static str> {
    Some(match code {
        "refusal_not_in_charge" => "`lager mode` changes who steers",
        "refusal_stop_latched" | "stopped" => "`lager resume` releases the stop",
        "refusal_no_board" | "calibration_broken" => "`lager doctor` looks for the cause",
        "outcome_no_board" => "`lager topic echo link/health` shows the links",
        "outcome_under_way" | "moving" => "`lager mode manual` or `lager stop` does",
        "order_unknown" => "`lager queue` shows those that do",
        "world_robot_there" => "`lager stop` stops it",
        "world_nothing_there" => "`lager obstacle` lists what stands",
        "world_full" => "`lager obstacle take` does",
        "failure_goods_delivered" | "failure_goods_away" => "`lager map back` says so",
        "logic_silent" | "order_untaken" => "is the robot up? (`lager up`)",
        _ => return None,
    })
}
