//! Tests of the operator panel in a real browser, with a simulated robot: it stands after every
//! kind of release, a stop is confirmed, goods are fetched, two people do not drive at once.

mod away;
mod browser;
mod commissioning;
mod driving;
mod editing;
mod fleet;
mod health;
mod keyboard;
mod legible;
mod manners;
mod map;
mod missions;
mod needs;
mod pictures;
mod played;
mod pressed;
mod reasons;
mod releases;
mod scene;
mod setting_up;
mod signals;
mod speeds;
mod stopping;
mod time;
mod traps;

use lager_orders::Sentence;
use lager_sample::Coded;
use lager_tests::wait_for;
use lager_topics::{
    FailureKind, Hold, Joint, LinkHealth, NavStatus, Phase, Remedy, StopCause, ThoughtKind,
};
use scene::{Scene, each_alone};

/// The page has a sentence in both languages for everything that the robot may report.
#[test]
fn every_name_that_a_robot_tells_has_its_sentence() {
    let table: Vec<&str> = Sentence::all().map(|sentence| sentence.name).collect();
    let mut missing = Vec::new();
    let mut look = |prefix: &str, variants: &mut dyn Iterator<Item = &str>| {
        let names = variants.map(|variant| format!("{prefix}{}", snake(variant)));
        missing.extend(names.filter(|name| !table.contains(&name.as_str())));
    };
    look("thought", &mut names::<ThoughtKind>());
    look("failure", &mut names::<FailureKind>());
    look("remedy", &mut names::<Remedy>());
    look("phase", &mut names::<Phase>());
    // `None` needs no sentence: nothing holds the robot.
    look("hold", &mut names::<Hold>().filter(|name| *name != "None"));
    look("stop_cause", &mut names::<StopCause>());
    look("joint", &mut names::<Joint>());
    assert!(missing.is_empty(), "{missing:#?}");
}

fn names<T: Coded>() -> impl Iterator<Item = &'static str> {
    T::VARIANTS.iter().map(|(_, name)| *name)
}

/// `LineLost` as `_line_lost`.
fn snake(name: &str) -> String {
    name.chars()
        .flat_map(|letter| {
            let capital = letter.is_ascii_uppercase();
            capital
                .then_some('_')
                .into_iter()
                .chain([letter.to_ascii_lowercase()])
        })
        .collect()
}

each_alone! {
    setting_up::the_map_is_moved_and_zoomed_by_hand_and_keys_and_obstacles_are_put_by_keys,
    missions::orders_are_moved_by_a_pointer_and_by_keys_as_the_robot_says,
    setting_up::the_queue_is_reordered_and_what_is_taken_out_can_be_put_back,
    setting_up::how_unsure_the_place_is_grows_until_the_next_mark,
    manners::a_stop_is_confirmed_stays_and_is_resumed_by_a_held_button,
    manners::somebody_else_s_stop_is_told_and_motion_is_left_out_for_who_wants_none,
    manners::the_display_on_the_robot_stops_it,
    stopping::stop_works_before_any_script_and_without_a_socket,
    stopping::a_stop_is_one_press_for_this_robot_by_name_and_another_robot_is_not_shown,
    stopping::one_press_on_fetch_is_one_order,
    driving::by_hand_needs_the_wheel_and_asks_during_a_mission,
    stopping::what_happens_to_the_robot_is_in_the_log_and_survives_the_station,
    manners::stop_is_apart_from_all_else_and_nothing_scrolls_on_a_laptop,
    manners::the_words_are_swedish_for_who_reads_swedish,
    setting_up::goods_and_obstacles_are_put_by_a_click_and_taken_back,
    setting_up::gains_are_set_and_put_back_and_a_calibration_goes_step_by_step,
    driving::whoever_lets_go_whatever_way_the_robot_stands,
    driving::two_people_do_not_drive_at_once_and_either_may_stop,
    driving::what_runs_once_is_not_cut_short_but_by_the_command_to_stand,
    driving::each_key_says_what_the_document_says_once_and_nothing_in_text_fields,
    driving::what_is_old_is_grey_with_its_time_and_drives_nothing,
    driving::of_two_keys_the_newer_counts_and_then_the_older_again,
    speeds::each_command_says_the_speed_that_is_chosen_and_another_one_counts_at_once,
    speeds::slow_is_slower_than_middle_and_middle_slower_than_full,
    driving::a_gamepad_drives_only_while_its_entry_lives_and_once_it_was_centred,
    driving::a_stop_that_refuses_a_key_is_ended_by_the_button_beside_it,
    driving::in_the_hand_map_and_pad_are_seen_together_and_a_finger_hits_what_it_wants,
    driving::after_driving_by_hand_the_page_asks_where_the_robot_stands_and_stops_meanwhile,
    traps::what_is_pressed_while_the_panel_is_silent_is_refused_and_never_done,
    signals::the_view_of_signals_shows_the_station_s_last_minutes_and_holds_still,
    signals::what_the_view_of_signals_cannot_fetch_is_said_and_the_histogram_has_all_frames,
    time::a_past_moment_is_marked_orders_nothing_and_is_the_same_on_another_page,
    time::a_clock_that_is_five_minutes_fast_makes_nothing_old_and_no_hold_longer,
    stopping::each_service_that_is_killed_has_its_end_and_its_return_in_the_log,
    stopping::what_is_ordered_in_a_terminal_is_in_the_log_with_who,
    health::a_killed_service_shows_as_died_and_back_with_its_count,
    health::a_board_is_restarted_while_the_robot_stands_and_not_on_its_way,
    health::help_opens_by_key_and_stop_works_over_it,
    health::the_theme_survives_a_reload_and_is_the_display_s_too,
    health::what_drives_is_shown_as_pressed,
    health::a_person_s_name_is_at_the_wheel_and_at_the_stop,
    away::a_hidden_page_lets_go_sends_nothing_on_its_return_and_shows_what_is_now,
    away::after_a_silence_the_first_pose_that_is_drawn_is_the_newest,
    away::a_page_that_looks_on_only_says_that_it_is_there_and_a_closed_tab_ends_its_hold,
    pressed::stop_is_never_off_and_claims_nothing_while_the_station_is_away,
    pressed::resume_ends_the_stop_or_says_why_not_each_time_that_it_is_held,
    pressed::a_field_keeps_what_is_typed_and_a_clicked_button_is_not_pressed_by_driving,
    pressed::enter_held_on_a_tile_and_in_the_field_orders_once,
    pressed::a_robot_on_its_way_is_not_calibrated_and_the_page_says_why,
    pressed::a_page_without_its_script_or_of_another_version_drives_nothing_and_stops,
    releases::each_way_to_let_go_ends_it_in_time_by_one_zero_and_then_silence,
}

#[test]
fn goods_are_queued_shown_and_delivered_round_an_obstacle() {
    let mut scene = Scene::new(4.0, &[]);
    let mut page = scene.page();
    let mut status = scene.bus.subscriber::<NavStatus>().expect("a topic");
    // The person chooses to pick by hand, and changes that when the robot stands at the goods.
    page.click("#picks");
    page.wait_until("!document.querySelector('#picks').checked");
    // Puts a thing on the short way to product 2 while the robot fetches product 1.
    page.click_at_mm(0.0, 750.0);
    page.wait_for("#map-said", "obstacle put");
    let waits_or_is_fetched = "['#queue', '#order-number'].some((at) => \
                               document.querySelector(at).textContent.includes('2'))";
    page.order("2", waits_or_is_fetched);
    // Its drawing moves as the robot does.
    let place = "document.querySelector('#map .robot').getAttribute('transform')";
    let before = page.value(place);
    wait_for("the picture to move", || {
        (page.value(place) != before).then_some(())
    });
    page.wait_for("#state", "stands at the goods");
    page.click("#picks");
    page.wait_until("document.querySelector('#picks').checked");
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");

    // A page that is reloaded in the middle of a mission shows the same.
    page.call("Page.reload", &serde_json::json!({}));
    page.wait_for("#link", " ms");
    page.wait_until("document.querySelectorAll('#map .blocked').length === 1");
    wait_for("both to be delivered", || {
        let status = status.latest().expect("readable")?;
        (status.delivered == 2).then_some(())
    });
    page.wait_until("document.querySelectorAll('#history li').length === 2");
    // The robot had to drive around the thing; the station keeps that for later pages.
    let history = page.text("#history");
    assert!(
        history.contains("round what was blocked: (0, "),
        "{history}"
    );
    page.call("Page.reload", &serde_json::json!({}));
    page.wait_until("document.querySelectorAll('#history li').length === 2");
    scene.saves(&mut page);
    drop((page, status));
    scene.wait_to_stand();
    scene.end();
}

#[test]
fn two_robots_are_shown_one_at_a_time_and_each_is_stopped_by_itself() {
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    let station = scene.up.output();
    let (_, rest) = station
        .split_once("listens at ")
        .expect("the station's address");
    // After it the line may say why this is not the usual address.
    let address = rest.split([' ', ',', '\n']).next().expect("an address");
    let second = scene
        .domain
        .start(&["--name", "r2", "up", "--headless", "--station", address]);
    page.wait_until("document.querySelectorAll('#robot option').length === 2");
    page.value(
        "(() => { const list = document.querySelector('#robot'); list.value = 'r2'; \
         list.dispatchEvent(new Event('change')); })()",
    );
    page.wait_for("#link", " ms");
    // The page's address keeps the chosen robot, and STOP names the robot that it stops.
    page.call("Page.reload", &serde_json::json!({}));
    page.wait_for("#link", " ms");
    page.wait_until("document.querySelector('#stop-whom').textContent === 'r2'");
    assert_eq!(page.value("document.querySelector('#robot').value"), "r2");
    page.click("#stop");
    page.wait_for("#stop-said", "both wheels stand");
    let stopped = |name: &str| {
        let mut health = scene
            .domain
            .observe(name, 1.0)
            .subscriber::<LinkHealth>()
            .expect("a topic");
        wait_for("its health", || {
            health
                .latest()
                .expect("readable")
                .map(|health| health.stopped)
        })
    };
    assert_eq!((stopped("r1"), stopped("r2")), (0, 1));
    scene.domain.done(&["--name", "r2", "resume"]);
    // One press stops all robots.
    page.click("#stop-all");
    page.wait_for("#stop-said", "r1: both wheels stand after");
    page.wait_for("#stop-said", "r2: both wheels stand after");
    assert_eq!((stopped("r1"), stopped("r2")), (1, 1));
    scene.domain.done(&["--name", "r2", "resume"]);
    scene.resume();
    drop((page, second));
    scene.end();
}
