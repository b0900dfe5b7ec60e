// Every word that the page shows, in Swedish and English. A test holds both to the same keys. What is not here
// stands in the table of sentences (bus/orders/sentences.txt).

import { TABLE } from "./table.js";

/** @type {Record<string, Record<string, string>>} */
const WORDS = {
  en: {
    add_product: "Add goods", age: "last heard {0} ago", arm: "Arm", arm_waits: "The robot drives: stop it first, then move the arm.",
    armed: "Armed to drive", autonomous: "Autonomous", backward: "back", battery: "battery",
    blocked: "not done: {0}", board_lost: "{0} is not heard", calibrate: "Calibrate (5 s)", calibrated: "Calibrated: all eleven sensors saw tape and floor.",
    calibrating: "Calibrating: a sensor is underlined once it has seen tape and floor.", calibration: "Line sensor",
    calibration_end: "Read here how it went.", calibration_how: "Press Calibrate, then move it slowly to and fro over tape and floor for five seconds.", calibration_put: "Put the robot over the tape.", sensors_read: "the line sensors read {0}; {1} of them have seen tape and floor", sensors_seen: "line sensors {0}", sensors_unheard: "the line sensors are not heard",
    cancel: "cancel", clear: "Clear queue", clockwise: "claw cw", control_free: "Nobody drives. Take the wheel",
    control_mine: "You drive. Let go", control_other: "{0} drives. Ask for the wheel", counterclockwise: "claw ccw", delivery: "Delivery corner", detours: "round what was blocked: {0}",
    distance: "distance", down: "down", drive: "Drive", duty: "duty L / R",
    duplicate: "two goods have the number {0}", fetch: "Fetch", fetches: "fetches {0}", filter: "filter", fit: "Fit", follow: "Follow", follow_back: "follow line back",
    follow_forward: "follow line", forward: "forward", full: "wait: the link does not keep up", gains: "Line control", gains_now: "now {0} and {1}", gains_unset: "as the board has them", put_back: "Put back {0} and {1}", goods: "goods", goods_string: "Goods as a string", goods_string_how: "write number,x,y,side with semicolons between, side 0 left, 1 up, 2 right, 3 down; this is not: {0}",
    history: "Delivered", history_empty: "Nothing yet.", in: "in", language: "Svenska", left: "left", left_diag: "45° left",
    load_file: "Load a file", map_string: "Map as a string", map_string_how: "write four numbers: squares in x and y, then the delivery corner, such as 4,3,0,3", no_warehouse: "this is no warehouse", no_way: "no way there", line: "Line", line_error: "line error", line_sensors: "line sensors", log: "Log", lost: "there is no connection to the station",
    log_empty: "Nothing that fits has happened.", losses: "lost", manual: "By hand", map: "map", missions: "Missions", mode_autonomous: "AUTONOMOUS", mode_manual: "BY HAND",
    name: "name", no_map: "The station knows no warehouse yet. Describe one under Set up.",
    no_robot: "No robot has connected yet. It does so by itself once it is up.", not_armed: "tick “{0}” first",
    nobody: "nobody drives", number: "number", obstacle_put: "obstacle put; click again to take it away", obstacle_taken: "obstacle taken away",
    old: "what is shown is old", out: "out", outside: "goods {0} stand outside", path: "path p50 / p99", person: "{0} drives", picked: "Pick-up done",
    picked_force: "Pick-up done, not felt", picks: "The robot picks goods up by itself", plain: "speaks only the document's language: no live picture",
    queue_empty: "Nothing waits.", reached_from: "from", refused: "{0}", release: "release", remove: "remove", reset: "It stands at the delivery, looking in",
    resume: "Hold to resume", right: "right", right_diag: "45° right", robot: "robot",
    save: "Save", save_csv: "Save CSV", save_file: "Save as a file", save_mcap: "Save MCAP", save_span: "how long back from what is shown", no_history: "this station keeps no history", history_busy: "others save as well: try again in a moment", saved: "saved", sent: "sent", servo_base: "base", servo_shoulder: "shoulder", servo_elbow: "elbow", servo_wrist: "wrist", servo_rotation: "rotation", servo_claw: "claw", servo_load: "load {0} %",
    servo_voltage: "input voltage", servo_angle: "angle limit", servo_heat: "too hot", servo_range: "value out of range", servo_checksum: "checksum", servo_overload: "overload", servo_instruction: "unknown instruction",
    set: "Set", setup: "Set up", signals: "Signals",
    side: "Side", size: "Squares", square: "square", squeeze: "squeeze", stand: "stand",
    stop: "STOP", stop_lost: "NOT SENT: there is no connection to the station", stop_unconfirmed: "sent, not confirmed: the robot may still be moving",
    stopped_short: "STOPPED", strips: "the last minute", station_drives: "itself", under_way: "under way", undo: "Undo", unheard: "never heard",
    up: "up", viewer: "you may look and stop", wait: "one at a time: a step is under way", where: "Say where it stands", zoom_in: "zoom in", zoom_out: "zoom out",
    asks: "{0} asks for the wheel.", asked_for: "{0} has been asked for the wheel", hand_over: "Hand over", keep: "Keep it", board_sensor: "the sensor board",
    board_steering: "the steering board", stop_refused: "NOT SENT: {0}", stopped_elsewhere: "STOPPED: {0}",
    move_up: "fetch {0} earlier", move_down: "fetch {0} later", cancel_order: "do not fetch {0}",
    real_floor: "put obstacles on a real floor by hand", text_size: "A warehouse of {0} by {1} squares. Goods: {2}.", text_robot: "The robot is at {0} and looks {1}.",
    took: "{0} in {1}", thinks: "“{0}”", notify: "Tell me by a message and a sound when a robot needs me", text_lost: "It is not known where the robot is.", text_next: "It goes to {0}.", text_blocked: "Blocked ways: {0}.", column: "column", row: "row", looks: "looks",
    where_asked: "Where does the robot stand?", on_crossing: "On this crossing:", stands_there: "It stands there", later: "Later", ghost: "where it really is", drives: "drives", volts: "{0} V", battery_low: "{0}, low",
    by_comm: "the station", by_operator: "a command in a terminal",
    did_stop: "{0} stops it", did_resume: "{0} releases the stop", did_mode: "{0} makes it {1}", did_take: "{0} takes the wheel", did_free: "{0} leaves the wheel", did_order: "{0} orders {1}", did_cancel: "{0} cancels order {1}",
    did_first: "{0} puts order {1} first", did_up: "{0} moves order {1} up", did_clear: "{0} clears the queue", did_reset: "{0} says that it stands at the delivery", did_place: "{0} says that it stands at {1}", did_pick_auto: "{0} lets the robot pick goods up by itself", did_pick_manual: "{0} has a person pick goods up",
    did_picked: "{0} says that the goods are picked up", did_gains: "{0} sets the line control to {1}", did_calibrate: "{0} calibrates", did_obstacle_put: "{0} puts an obstacle at {1}", did_obstacle_take: "{0} takes away the obstacle at {1}",
    field_range: "{0}: a number from {1} to {2}", field_least: "{0}: a number from {1} up",
    fleet: "Robots", orders_wait: "waiting orders: {0}", not_here: "{0} is not here", stop_all: "Stop all",
    hold_longer: "hold it for a second", stopped_again: "it was stopped again meanwhile", still_moves: "it still moves", was_to_fetch: "was to fetch {0}", then_stands: "Released, it stands until somebody drives it.",
    then_needs: "Released, it still needs what is said above.", then_waits: "Released, it waits for an order.", then_fetches: "Released, it goes on by itself: it fetches {0}.",
    hand_asked: "The robot is fetching {0}. Without an answer it goes on in {1} s.", hand_now: "By hand now", hand_leave: "Leave it to the robot",
    place_unknown: "place unknown", placed: "obstacle that stands there", found: "found blocked", text_placed: "Obstacles stand at: {0}.",
    side_limits: "the robot drives in squares of {0} to {2} cm; these are {1} cm", size_limits: "the robot knows up to {0} squares along a side; here are {1}", goods_limits: "the robot knows up to {0} goods; here are {1}",
    tip_click: "click: {0}", tip_enter: "Enter: {0}", tip_good: "{0}, square {1}", tip_crossing: "crossing {0}", tip_way: "the way from {0} to {1}", tip_square: "square {0}, reached from: {1}",
    does_fetch: "fetch it", does_fetch_as: "fetch it, as number {0}", does_ask_back: "say that it is back, and fetch it", does_stand: "say that the robot stands here",
    does_put: "put an obstacle here", does_take: "take the obstacle away", does_goods: "put goods {0} here", in_claw: "it is in the claw", is_fetched: "the robot fetches it",
    waits_as: "ordered, as number {0}", delivered: "delivered", away: "not here", delivered_at: "delivered at {0}", found_for: "found blocked {0} s ago",
    place_how: "after “{0}” a click says that the robot stands here", nothing_here: "there is no way; click on goods, or on a way between two crossings",
    back_delivered: "{0} was delivered at {1}. Is it in its place again?", back_away: "{0} is not in its place. Is it there again?", back_yes: "It is there: fetch it", back_no: "Do not fetch it",
    delivered_here: "Delivery", flag_next: "next {0}", flag_blocked: "blocked {0} s", legend: "Legend", legend_robot: "the robot", legend_unsure: "where it may be",
    legend_route: "its route; the ring is the next crossing", legend_trail: "where it has driven", legend_goods: "goods", legend_ordered: "goods that are ordered, with their turn",
    legend_gone: "goods that are not in their place", map_how: "Arrows choose goods, crossings and ways; the tip says what Enter does there. With Shift the arrows move the map, plus and minus zoom.",
    reload: "Load the page anew",
    plots_loading: "The plots are being fetched.", plots_failed: "The plots could not be fetched. Look whether the station can be reached, then try again.", plots_again: "Try again",
    pause: "Pause", go_live: "Go live", paused: "paused, {0} behind", time_window: "time that is shown", zoom_back: "Zoom back", lanes_how: "signals; left and right move the cursor", newest: "Newest", at_cursor: "At the cursor",
    history_fetched: "The last ten minutes are being fetched.", unit_sensors: "sensors", unit_lost: "in 1 s", lane_duty: "duty", lane_distance: "distance ahead", lane_path: "path latency", lane_lost: "lost packets",
    path_histogram: "Path latency, sensor to decision", frames_told: "{0} frames since this page was opened; heights are square roots", frames_none: "No frame has been measured yet.", lost_by_minute: "Packets lost each minute", lost_in_all: "{0} in ten minutes",
    time_line: "time line", time_span: "how long the time line is", time_now: "Now", time_before: "what happened before (K)", time_after: "what happened after (J)",
    moment: "the moment {0}", moment_ago: "the moment {0}, {1} ago", moment_none: "The station has kept nothing of this moment.", past_orders: "this is the past: press “Now”, then click",
    log_all: "All", log_stop: "stop", log_help: "help", log_goods: "goods", log_ways: "way", log_persons: "person", log_link: "link", log_battery: "battery", log_settings: "settings",
    log_kinds: "which kinds are shown", log_earlier: "Earlier", log_no_earlier: "The station has kept nothing from before that.",
    did_ask: "{0} asks for the wheel", did_keep: "{0} keeps the wheel", did_warehouse: "{0} describes the warehouse anew",
    step_begun: "set out", step_asked: "ordered", step_arrived: "arrived", step_picked: "picked", step_carried: "carried", now: "now", order_to: "to delivery", order_from: "from square {0} to delivery", goods_numbered: "goods {0}",
    queue_head: "Next: {0} of {1} goods", queue: "orders that wait: drag a row, or press Alt with an arrow on it; Delete takes it out", turn: "number {0} of {1}", by: "by {0}", put_off_way: "put off: no way there", put_off_battery: "put off: battery low",
    search: "Fetch: number or name", search_none: "no goods are called so", search_one: "Enter fetches {0}", search_many: "several goods match: {0}",
    in_minutes: "{0} min", battery_alarm: "The battery is nearly empty: {0}",
    past_open: "{0} delivered today", past_close: "Back to the orders", past_goods: "all goods", past_time: "since when", past_day: "the last 24 hours", past_today: "today", past_totals: "Delivered: {0} today, {1} in the last 24 hours",
    health: "Health", health_page: "This page", health_station: "Station", health_trip: "{0} ms there and back", health_heard: "heard", health_links: "Links",
    health_services: "Services of the robot", health_machine: "The robot's machine", health_losses: "Losses", health_versions: "Versions",
    health_station_helps: "Is the station's computer on, and is this one in the same network? The page tries again by itself.",
    health_robot_helps: "Is it switched on, and in the same network? Has it driven out of range? It connects again by itself.",
    health_runs: "runs for {0}", health_died: "ended {0} ago", health_restarts: "started again: {0}",
    health_down: "It has ended and is started again by itself. If it stays so, start the robot anew.",
    health_often: "It has ended again and again. The robot's own output says why; save it for whoever keeps the robot.",
    health_lost: "lost {0}, damaged {1}, restarts {2}", health_between: "between the services", health_missed: "lost {0}",
    health_load: "Processor", health_load_of: "{0} % wanted of {1} cores", health_memory: "Memory", health_memory_of: "{0} of {1} MiB free",
    health_finding: "To be mended", health_findings: "Findings", health_nothing: "nothing is wrong",
    health_update: "Robot and station have different releases: update the older one.",
    health_original: "original board", health_packets: "packets of version {0}", health_as_of: "What is shown of the robot is {0} old.", health_untold: "The robot has not told its health yet.",
    mark_good: "good", mark_bad: "needs somebody", mark_unknown: "not known",
    help: "Help: signs and keys", help_close: "Close", help_states: "States", help_colours: "Colours", help_keys: "Keys", help_map_keys: "Keys on the map",
    help_drive_keys: "Keys that drive, while armed", help_arm_keys: "Keys of the arm, while armed",
    look_unheard: "The robot is not heard: what is shown is old.", look_stopped: "Stopped: it stands until somebody resumes.", look_board: "One of its boards is not heard.",
    look_lost: "It does not know where it stands.", look_needs: "It needs a person.", look_hand: "Somebody drives it by hand.", look_waits: "It waits.", look_drives: "It drives by itself.", look_none: "No robot, or nothing is known yet.",
    colour_accent: "the robot, its way, and what is chosen", colour_goods: "goods", colour_caution: "needs a person, or is old", colour_danger: "STOP, stopped, blocked", colour_quiet: "labels, and what is old",
    key_stop: "STOP, whatever has the focus", key_space: "STOP, but for a field to write in and for Resume", key_help: "this help, unless armed", help_view_keys: "Keys of the views", key_search: "find goods by number or name", key_events: "what happened before, and after", key_time: "on the time line and the curves: another moment", key_queue: "move the order that has the focus", key_queue_out: "take that order out", key_undo: "in Set up: undo", key_redo: "in Set up: do it again", key_save: "in Set up: save", key_next: "the next control", key_tabs: "another view, on the list of views", key_press: "press a button, tick a box",
    key_map: "choose goods, crossings and ways", key_map_enter: "do what the tip says", key_map_move: "move the map", key_map_zoom: "zoom",
    theme: "Theme", theme_system: "Theme: auto", theme_light: "Light", theme_dark: "Dark", sticks: "sticks of the gamepad",
    discard: "Discard", keep_name: "Keep", move: "Move", close: "close", kept: "Where it is kept",
    set_up_how: "Click on a side of a square to put goods there, on goods to rename them, on a corner for the delivery. Drag goods to move them, an edge to change the size.",
    undo_what: "undoes: {0}", redo_what: "does again: {0}", unsaved_one: "1 change not saved", unsaved_many: "{0} changes not saved",
    saved_elsewhere: "somebody else has saved another warehouse meanwhile: Save replaces it, Discard shows it", change_all: "several changes", change_size: "size {0} × {1}",
    change_delivery: "delivery at ({0})", change_side: "side {0} cm", change_placed: "goods {0} placed", change_removed: "goods {0} removed", change_moved: "goods {0} moved",
    change_named: "goods {0} renamed", same_name: "two goods are named {0}", no_corner: "({0}) is no corner of this floor", squares: "{0} squares · {1} m",
    does_move: "move goods {0} here", does_name: "rename, move or remove them", does_deliver: "deliver here", is_delivery: "goods are delivered here",
    move_how: "Choose the side of a square for goods {0}.", tip_corner: "corner ({0})", tip_edge_right: "right edge: drag to change the size", tip_edge_up: "upper edge: drag to change the size",
    does_edge_right: "one more column", does_edge_up: "one more row", kept_in: "What is saved here is kept in {0}.", kept_nowhere: "It is kept until the station ends: the station has no file for it.",
    uses_unknown: "which warehouse {0} uses is not known here", renew: "Put {0} into this warehouse",
    renew_how: "{0} is simulated. It is stopped and put on the delivery node of this warehouse, and its world begins anew: all goods are in their places. It moves again once somebody releases the stop.",
    renew_drops: "Orders that do not fit any more are dropped: goods {0}.", renew_yes: "Stop it and put it there", renew_no: "Leave it where it is",
    renews: "{0} is stopped and put into the saved warehouse; hold Resume to let it move.",
    tip_stack: "square {0}: {1}", does_choose: "choose one of them", legend_stack: "several goods; a click lists them",
    speed: "Speed", speed_how: "speed of the arrows; following the line and turns of 45° have their own", slow: "slow", middle: "middle", full_speed: "full",
  },
  sv: {
    add_product: "Lägg till vara", age: "hörd för {0} sedan", arm: "Arm", arm_waits: "Roboten kör: stanna först, flytta sedan armen.",
    armed: "Klar att köra", autonomous: "Autonom", backward: "bakåt", battery: "batteri",
    blocked: "inte gjort: {0}", board_lost: "{0} hörs inte", calibrate: "Kalibrera (5 s)", calibrated: "Kalibrerad: alla elva sensorer såg tejp och golv.",
    calibrating: "Kalibrerar: en sensor stryks under när den har sett tejp och golv.", calibration: "Linjesensor",
    calibration_end: "Läs här hur det gick.", calibration_how: "Tryck på Kalibrera och för den sedan långsamt fram och tillbaka över tejp och golv i fem sekunder.", calibration_put: "Ställ roboten över tejpen.", sensors_read: "linjesensorerna läser {0}; {1} av dem har sett tejp och golv", sensors_seen: "linjesensorer {0}", sensors_unheard: "linjesensorerna hörs inte",
    cancel: "ta bort", clear: "Töm kön", clockwise: "klo medurs", control_free: "Ingen kör. Ta ratten",
    control_mine: "Du kör. Släpp ratten", control_other: "{0} kör. Be om ratten", counterclockwise: "klo moturs", delivery: "Leveranshörn", detours: "runt det som var spärrat: {0}",
    distance: "avstånd", down: "ner", drive: "Kör", duty: "pådrag V / H",
    duplicate: "två varor har numret {0}", fetch: "Hämta", fetches: "hämtar {0}", filter: "filter", fit: "Allt", follow: "Följ", follow_back: "följ linje bakåt",
    follow_forward: "följ linje", forward: "framåt", full: "vänta: länken hinner inte med", gains: "Linjereglering", gains_now: "nu {0} och {1}", gains_unset: "som kortet har dem", put_back: "Återställ {0} och {1}", goods: "varor", goods_string: "Varor som sträng", goods_string_how: "skriv nummer,x,y,sida med semikolon emellan, sida 0 vänster, 1 upp, 2 höger, 3 ner; detta är det inte: {0}",
    history: "Levererat", history_empty: "Inget ännu.", in: "in", language: "English", left: "vänster", left_diag: "45° vänster",
    load_file: "Läs in fil", map_string: "Karta som sträng", map_string_how: "skriv fyra tal: rutor i x och y, sedan leveranshörnet, som 4,3,0,3", no_warehouse: "detta är inget lager", no_way: "ingen väg dit", line: "Linje", line_error: "linjefel", line_sensors: "linjesensorer", log: "Logg", lost: "ingen förbindelse med stationen",
    log_empty: "Inget sådant har hänt.", losses: "förlorat", manual: "För hand", map: "karta", missions: "Uppdrag", mode_autonomous: "AUTONOM", mode_manual: "FÖR HAND",
    name: "namn", no_map: "Stationen känner inget lager än. Beskriv ett under Ställ in.",
    no_robot: "Ingen robot har anslutit än. Den gör det själv när den är igång.", not_armed: "kryssa i ”{0}” först",
    nobody: "ingen kör", number: "nummer", obstacle_put: "hinder utställt; klicka igen för att ta bort det", obstacle_taken: "hinder borttaget",
    old: "det som visas är gammalt", out: "ut", outside: "vara {0} står utanför", path: "väg p50 / p99", person: "{0} kör", picked: "Upplockning klar",
    picked_force: "Upplockning klar, känns ej", picks: "Roboten plockar upp varorna själv", plain: "talar bara dokumentets språk: ingen levande bild",
    queue_empty: "Inget väntar.", reached_from: "från", refused: "{0}", release: "släpp", remove: "ta bort", reset: "Den står vid leveransen och ser in i lagret",
    resume: "Håll för att fortsätta", right: "höger", right_diag: "45° höger", robot: "robot",
    save: "Spara", save_csv: "Spara CSV", save_file: "Spara som fil", save_mcap: "Spara MCAP", save_span: "hur långt bakåt från det som visas", no_history: "denna station har ingen historik", history_busy: "andra sparar också: försök igen om en stund", saved: "sparat", sent: "skickat", servo_base: "bas", servo_shoulder: "axel", servo_elbow: "armbåge", servo_wrist: "handled", servo_rotation: "vridning", servo_claw: "klo", servo_load: "last {0} %",
    servo_voltage: "matningsspänning", servo_angle: "vinkelgräns", servo_heat: "för varm", servo_range: "värde utanför området", servo_checksum: "kontrollsumma", servo_overload: "överlast", servo_instruction: "okänd instruktion",
    set: "Sätt", setup: "Ställ in", signals: "Signaler",
    side: "Sida", size: "Rutor", square: "ruta", squeeze: "kläm", stand: "stå",
    stop: "STOPP", stop_lost: "EJ SKICKAT: ingen förbindelse med stationen", stop_unconfirmed: "skickat, ej bekräftat: roboten kan röra sig",
    stopped_short: "STOPPAD", strips: "senaste minuten", station_drives: "själv", under_way: "på väg", undo: "Ångra", unheard: "aldrig hörd",
    up: "upp", viewer: "du får titta och stoppa", wait: "en i taget: ett steg pågår", where: "Säg var den står", zoom_in: "närmare", zoom_out: "längre bort",
    asks: "{0} ber om ratten.", asked_for: "{0} har fått frågan om ratten", hand_over: "Lämna över", keep: "Behåll den", board_sensor: "sensorkortet",
    board_steering: "styrkortet", stop_refused: "EJ SKICKAT: {0}", stopped_elsewhere: "STOPPAD: {0}",
    move_up: "hämta {0} tidigare", move_down: "hämta {0} senare", cancel_order: "hämta inte {0}",
    real_floor: "ställ ut hinder för hand på ett riktigt golv", text_size: "Ett lager med {0} gånger {1} rutor. Varor: {2}.",
    text_robot: "Roboten är vid {0} och tittar {1}.", took: "{0} på {1}", thinks: "”{0}”", notify: "Säg till med meddelande och ljud när en robot behöver mig", text_lost: "Det är okänt var roboten är.", text_next: "Den kör till {0}.", text_blocked: "Spärrade vägar: {0}.",
    column: "kolumn", row: "rad", looks: "tittar", where_asked: "Var står roboten?", on_crossing: "I den här korsningen:", stands_there: "Där står den", later: "Senare",
    ghost: "där den verkligen är", drives: "kör", volts: "{0} V", battery_low: "{0}, lågt",
    by_comm: "stationen", by_operator: "ett kommando i en terminal",
    did_stop: "{0} stoppar den", did_resume: "{0} häver stoppet", did_mode: "{0} gör den {1}", did_take: "{0} tar ratten", did_free: "{0} lämnar ratten", did_order: "{0} beställer {1}", did_cancel: "{0} tar bort order {1}",
    did_first: "{0} lägger order {1} först", did_up: "{0} flyttar upp order {1}", did_clear: "{0} tömmer kön", did_reset: "{0} säger att den står vid leveransen", did_place: "{0} säger att den står vid {1}", did_pick_auto: "{0} låter roboten plocka upp varor själv", did_pick_manual: "{0} låter en människa plocka upp varor",
    did_picked: "{0} säger att varan är upplockad", did_gains: "{0} sätter linjeregleringen till {1}", did_calibrate: "{0} kalibrerar", did_obstacle_put: "{0} ställer ut ett hinder vid {1}", did_obstacle_take: "{0} tar bort hindret vid {1}",
    field_range: "{0}: ett tal från {1} till {2}", field_least: "{0}: ett tal från {1}",
    fleet: "Robotar", orders_wait: "väntande order: {0}", not_here: "{0} finns inte här", stop_all: "Stoppa alla",
    hold_longer: "håll den i en sekund", stopped_again: "den stoppades igen under tiden", still_moves: "den rör sig ännu", was_to_fetch: "skulle hämta {0}", then_stands: "Släppt står den tills någon kör den.",
    then_needs: "Släppt behöver den ändå det som sägs ovan.", then_waits: "Släppt väntar den på en order.", then_fetches: "Släppt fortsätter den själv: den hämtar {0}.",
    hand_asked: "Roboten hämtar {0}. Utan svar fortsätter den om {1} s.", hand_now: "För hand nu", hand_leave: "Låt roboten köra",
    place_unknown: "okänd plats", placed: "hinder som står där", found: "funnen spärrad", text_placed: "Hinder står vid: {0}.",
    side_limits: "roboten kör i rutor om {0} till {2} cm; dessa är {1} cm", size_limits: "roboten kan högst {0} rutor längs en sida; här är {1}", goods_limits: "roboten kan högst {0} varor; här är {1}",
    tip_click: "klicka: {0}", tip_enter: "Enter: {0}", tip_good: "{0}, ruta {1}", tip_crossing: "korsning {0}", tip_way: "vägen från {0} till {1}", tip_square: "ruta {0}, nås från: {1}",
    does_fetch: "hämta den", does_fetch_as: "hämta den, som nummer {0}", does_ask_back: "säg att den är tillbaka, och hämta den", does_stand: "säg att roboten står här",
    does_put: "ställ ut ett hinder här", does_take: "ta bort hindret", does_goods: "ställ vara {0} här", in_claw: "den är i klon", is_fetched: "roboten hämtar den", waits_as: "beställd, som nummer {0}",
    delivered: "levererad", away: "inte här", delivered_at: "levererad {0}", found_for: "funnen spärrad för {0} s sedan", place_how: "efter ”{0}” säger ett klick att roboten står här",
    nothing_here: "där finns ingen väg; klicka på en vara, eller på en väg mellan två korsningar", back_delivered: "{0} levererades {1}. Är den på sin plats igen?",
    back_away: "{0} är inte på sin plats. Är den där igen?", back_yes: "Den är där: hämta den", back_no: "Hämta den inte", delivered_here: "Leverans", flag_next: "nästa {0}",
    flag_blocked: "spärrad {0} s", legend: "Teckenförklaring", legend_robot: "roboten", legend_unsure: "där den kan vara", legend_route: "dess väg; ringen är nästa korsning",
    legend_trail: "där den har kört", legend_goods: "vara", legend_ordered: "beställd vara, med sin tur", legend_gone: "vara som inte är på sin plats",
    map_how: "Pilarna väljer varor, korsningar och vägar; rutan säger vad Enter gör där. Med Skift flyttar pilarna kartan, plus och minus zoomar.",
    reload: "Ladda om sidan",
    plots_loading: "Diagrammen hämtas.", plots_failed: "Diagrammen kunde inte hämtas. Se efter om stationen kan nås och försök sedan igen.", plots_again: "Försök igen",
    pause: "Pausa", go_live: "Visa nuet", paused: "pausad, {0} efter", time_window: "tid som visas", zoom_back: "Zooma tillbaka", lanes_how: "signaler; vänster och höger flyttar markören", newest: "Nyast", at_cursor: "Vid markören",
    history_fetched: "De senaste tio minuterna hämtas.", unit_sensors: "sensorer", unit_lost: "på 1 s", lane_duty: "pådrag", lane_distance: "avstånd framåt", lane_path: "fördröjning", lane_lost: "förlorade paket",
    path_histogram: "Fördröjning från sensor till beslut", frames_told: "{0} mätningar sedan sidan öppnades; höjderna är kvadratrötter", frames_none: "Inget har mätts än.", lost_by_minute: "Förlorade paket varje minut", lost_in_all: "{0} på tio minuter",
    time_line: "tidslinje", time_span: "hur lång tidslinjen är", time_now: "Nu", time_before: "det som hände före (K)", time_after: "det som hände efter (J)",
    moment: "ögonblicket {0}", moment_ago: "ögonblicket {0}, för {1} sedan", moment_none: "Stationen har inte sparat något av det ögonblicket.", past_orders: "detta är det förflutna: tryck på ”Nu”, klicka sedan",
    log_all: "Allt", log_stop: "stopp", log_help: "hjälp", log_goods: "varor", log_ways: "väg", log_persons: "person", log_link: "länk", log_battery: "batteri", log_settings: "inställning",
    log_kinds: "vilka slag som visas", log_earlier: "Tidigare", log_no_earlier: "Stationen har inte sparat något från tiden före det.",
    did_ask: "{0} ber om ratten", did_keep: "{0} behåller ratten", did_warehouse: "{0} beskriver lagret på nytt",
    step_begun: "ivägkörd", step_asked: "beställd", step_arrived: "framme", step_picked: "plockad", step_carried: "bärs", now: "nu", order_to: "till leveransen", order_from: "från ruta {0} till leveransen", goods_numbered: "vara {0}",
    queue_head: "Näst: {0} av {1} varor", queue: "order som väntar: dra en rad, eller tryck Alt och en pil på den; Delete tar bort den", turn: "nummer {0} av {1}", by: "av {0}", put_off_way: "uppskjuten: ingen väg dit", put_off_battery: "uppskjuten: svagt batteri",
    search: "Hämta: nummer eller namn", search_none: "ingen vara heter så", search_one: "Enter hämtar {0}", search_many: "flera varor passar: {0}",
    in_minutes: "{0} min", battery_alarm: "Batteriet är nästan tomt: {0}",
    past_open: "{0} levererade i dag", past_close: "Tillbaka till ordrarna", past_goods: "alla varor", past_time: "sedan när", past_day: "de senaste 24 timmarna", past_today: "i dag", past_totals: "Levererat: {0} i dag, {1} de senaste 24 timmarna",
    health: "Hälsa", health_page: "Sidan", health_station: "Station", health_trip: "{0} ms fram och tillbaka", health_heard: "hörs", health_links: "Länkar",
    health_services: "Robotens tjänster", health_machine: "Robotens maskin", health_losses: "Förluster", health_versions: "Versioner",
    health_station_helps: "Är stationens dator på, och är den här i samma nätverk? Sidan försöker igen av sig själv.",
    health_robot_helps: "Är den på, och i samma nätverk? Har den kört utom räckhåll? Den ansluter igen av sig själv.",
    health_runs: "igång i {0}", health_died: "slutade för {0} sedan", health_restarts: "startad på nytt: {0}",
    health_down: "Den har slutat och startas igen av sig själv. Om det förblir så, starta om roboten.",
    health_often: "Den har slutat gång på gång. Robotens egna utskrifter säger varför; spara dem åt den som sköter roboten.",
    health_lost: "förlorade {0}, skadade {1}, omstarter {2}", health_between: "mellan tjänsterna", health_missed: "förlorade {0}",
    health_load: "Processor", health_load_of: "{0} % önskas av {1} kärnor", health_memory: "Minne", health_memory_of: "{0} av {1} MiB ledigt",
    health_finding: "Att åtgärda", health_findings: "Fynd", health_nothing: "inget är fel",
    health_update: "Robot och station har olika versioner: uppdatera den äldre.",
    health_original: "originalkort", health_packets: "paket av version {0}", health_as_of: "Det som visas av roboten är {0} gammalt.", health_untold: "Roboten har inte berättat om sin hälsa än.",
    mark_good: "bra", mark_bad: "behöver någon", mark_unknown: "okänt",
    help: "Hjälp: tecken och tangenter", help_close: "Stäng", help_states: "Tillstånd", help_colours: "Färger", help_keys: "Tangenter", help_map_keys: "Tangenter på kartan",
    help_drive_keys: "Tangenter som kör, när det är klart att köra", help_arm_keys: "Armens tangenter, när det är klart att köra",
    look_unheard: "Roboten hörs inte: det som visas är gammalt.", look_stopped: "Stoppad: den står tills någon häver stoppet.", look_board: "Ett av dess kort hörs inte.",
    look_lost: "Den vet inte var den står.", look_needs: "Den behöver en människa.", look_hand: "Någon kör den för hand.", look_waits: "Den väntar.", look_drives: "Den kör själv.", look_none: "Ingen robot, eller inget är känt än.",
    colour_accent: "roboten, dess väg och det som är valt", colour_goods: "varor", colour_caution: "behöver en människa, eller är gammalt", colour_danger: "STOPP, stoppad, spärrad", colour_quiet: "etiketter, och det som är gammalt",
    key_stop: "STOPP, vad som än har fokus", key_space: "STOPP, utom i ett fält att skriva i och på knappen som häver stoppet", key_help: "den här hjälpen, om det inte är klart att köra", help_view_keys: "Vyernas tangenter", key_search: "sök varor efter nummer eller namn", key_events: "det som hände före, och efter", key_time: "på tidslinjen och kurvorna: ett annat ögonblick", key_queue: "flytta ordern som har fokus", key_queue_out: "ta bort den ordern", key_undo: "i Ställ in: ångra", key_redo: "i Ställ in: gör om", key_save: "i Ställ in: spara", key_next: "nästa knapp eller fält", key_tabs: "en annan vy, i listan över vyer", key_press: "tryck en knapp, kryssa i en ruta",
    key_map: "välj varor, korsningar och vägar", key_map_enter: "gör det som rutan säger", key_map_move: "flytta kartan", key_map_zoom: "zooma",
    theme: "Tema", theme_system: "Tema: auto", theme_light: "Ljust", theme_dark: "Mörkt", sticks: "handkontrollens spakar",
    discard: "Kasta", keep_name: "Behåll", move: "Flytta", close: "stäng", kept: "Var det sparas",
    set_up_how: "Klicka på en rutas sida för att ställa en vara där, på en vara för att döpa om den, på ett hörn för leveransen. Dra en vara för att flytta den, en kant för att ändra storleken.",
    undo_what: "ångrar: {0}", redo_what: "gör om: {0}", unsaved_one: "1 ändring inte sparad", unsaved_many: "{0} ändringar inte sparade",
    saved_elsewhere: "någon annan har sparat ett annat lager under tiden: Spara ersätter det, Kasta visar det", change_all: "flera ändringar", change_size: "storlek {0} × {1}",
    change_delivery: "leverans vid ({0})", change_side: "sida {0} cm", change_placed: "vara {0} utställd", change_removed: "vara {0} borttagen", change_moved: "vara {0} flyttad",
    change_named: "vara {0} omdöpt", same_name: "två varor heter {0}", no_corner: "({0}) är inget hörn av det här golvet", squares: "{0} rutor · {1} m",
    does_move: "flytta vara {0} hit", does_name: "döp om, flytta eller ta bort den", does_deliver: "leverera här", is_delivery: "här levereras varorna", move_how: "Välj en rutas sida för vara {0}.",
    tip_corner: "hörn ({0})", tip_edge_right: "höger kant: dra för att ändra storleken", tip_edge_up: "övre kant: dra för att ändra storleken", does_edge_right: "en kolumn till",
    does_edge_up: "en rad till", kept_in: "Det som sparas här finns i {0}.", kept_nowhere: "Det finns kvar tills stationen avslutas: stationen har ingen fil för det.",
    uses_unknown: "vilket lager {0} använder är okänt här", renew: "Ställ {0} i det här lagret",
    renew_how: "{0} är simulerad. Den stoppas och ställs på leveransnoden i det här lagret, och dess värld börjar om: alla varor står på sina platser. Den rör sig igen när någon häver stoppet.",
    renew_drops: "Order som inte passar längre stryks: vara {0}.", renew_yes: "Stoppa den och ställ den där", renew_no: "Låt den vara",
    renews: "{0} stoppas och ställs i det sparade lagret; håll Fortsätt för att låta den röra sig.",
    tip_stack: "ruta {0}: {1}", does_choose: "välj en av dem", legend_stack: "flera varor; ett klick listar dem",
    speed: "Fart", speed_how: "pilarnas fart; att följa linjen och att vända 45° har sin egen", slow: "sakta", middle: "halv", full_speed: "full",
  },
};

/**
 * The language in use, which the page itself keeps: chosen before, or the browser's.
 *
 * @returns {"en" | "sv"}
 */
export function current() {
  const { language } = document.documentElement.dataset;
  if (language === "en" || language === "sv") return language;
  return use(localStorage.getItem("language") ?? navigator.language);
}

/** Changes to the other language. */
export function change() {
  use(current() === "sv" ? "en" : "sv");
  localStorage.setItem("language", current());
}

/**
 * Uses the language of a tag such as `sv-SE`; English if the page does not know it.
 *
 * @param {string} tag
 */
function use(tag) {
  const language = tag.startsWith("sv") ? "sv" : "en";
  const root = document.documentElement;
  root.dataset.language = root.lang = language;
  return language;
}

/** @typedef {[string, ...(string | number | null | undefined)[]]} Words A key of this table, and its values. */

/**
 * A word or sentence; {0} and so on are filled in.
 *
 * @param {string} key
 * @param {(string | number | null | undefined)[]} values
 * @returns {string}
 */
export function say(key, ...values) {
  const text = WORDS[current()]?.[key] ?? TABLE[key]?.[current()] ?? key;
  return text.replace(/\{(\d)\}/g, (_, index) => String(values[index] ?? ""));
}

/**
 * A number with one decimal, as the language writes it.
 *
 * @param {number} value
 */
export function decimal(value) {
  const text = value.toFixed(1);
  return current() === "sv" ? text.replace(".", ",") : text;
}

/**
 * The time of day of a moment in ms since 1970.
 *
 * @param {number} at
 */
export function clock(at) {
  return new Date(at).toLocaleTimeString(current(), { hourCycle: "h23", hour: "2-digit", minute: "2-digit", second: "2-digit" });
}

/**
 * A time in ms, in words.
 *
 * @param {number} ms
 */
export function span(ms) {
  if (ms < 1_000) return `${Math.max(0, Math.round(ms))} ms`;
  if (ms < 60_000) return `${decimal(ms / 1_000)} s`;
  if (ms < 3_600_000) return `${Math.floor(ms / 60_000)} min`;
  return `${Math.floor(ms / 3_600_000)} h`;
}

/**
 * A time in ms as minutes and seconds, such as 1:05, or as seconds below a minute.
 *
 * @param {number} ms
 */
export function minutes(ms) {
  const all = Math.max(0, Math.round(ms / 1_000));
  const [hours, rest, seconds] = [Math.floor(all / 3_600), Math.floor((all % 3_600) / 60), all % 60];
  if (all < 60) return `${seconds} s`;
  const two = [rest, seconds].map((part) => String(part).padStart(2, "0"));
  return hours ? `${hours}:${two.join(":")}` : `${rest}:${two[1]}`;
}

/**
 * Fills in the words that stand in the page itself.
 *
 * @param {ParentNode} part
 */
export function translate(part = document) {
  /** @param {string} name */
  const all = (name) => [...part.querySelectorAll(`[${name}]`)].map((element) => ({ element, words: say(element.getAttribute(name) ?? "") }));
  for (const { element, words } of all("data-word")) element.textContent = words;
  for (const { element, words } of all("data-label")) {
    element.setAttribute("aria-label", words);
    if (element.matches("input[type=search], #name")) element.setAttribute("placeholder", words);
  }
  for (const { element, words } of all("data-title")) {
    element.setAttribute("title", words);
    element.setAttribute("aria-label", words);
  }
}

/**
 * Changes a text only where it is another one: a live region would say it again.
 *
 * @param {Element} element
 * @param {string} text
 */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
