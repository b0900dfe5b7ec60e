//! Every production of the grammars as it may be written, blanks and number forms included.

use lager_lines::conversation::{AnswerRefused, Held, RobotLine, StationLine};
use lager_lines::extension::Order;
use lager_lines::gag::{Answer, Query, Request};
use lager_lines::strings::{Goods, read_map};

/// What each line is once it is written again.
fn requests(lines: &[(&str, &str)]) {
    for (line, written) in lines {
        let request = Request::read(line).expect(line);
        assert_eq!(request.to_string(), *written, "{line:?}");
        let of_robot = RobotLine::read(line).expect(line);
        assert_eq!(of_robot, RobotLine::Request(request), "{line:?}");
    }
}

fn answers(lines: &[(&str, &str)]) {
    for (line, written) in lines {
        let answer = Answer::read(line).expect(line);
        assert_eq!(answer.to_string(), *written, "{line:?}");
        let of_station = StationLine::read(line).expect(line);
        assert_eq!(of_station, StationLine::Answer(answer), "{line:?}");
    }
}

#[test]
fn every_request_is_read_with_any_blanks() {
    for query in Query::ALL {
        let word = query.as_str();
        for line in [word.to_owned(), format!(" \t{word}"), format!("{word} \t ")] {
            assert_eq!(Request::read(&line), Ok(Request::Query(query)), "{line:?}");
        }
    }
    requests(&[
        ("set_robot 0 0", "set_robot 0 0"),
        ("\tset_robot\t 255  255 ", "set_robot 255 255"),
        ("set_robot 007 -0", "set_robot 7 0"),
        (" set_heading   down\t", "set_heading down"),
        ("thought", "thought "),
        ("thought ", "thought "),
        ("  thought x", "thought x"),
        ("thought  x ", "thought  x "),
        ("thought\t\tx", "thought \tx"),
        (
            "thought prodlis 0; karta → å",
            "thought prodlis 0; karta → å",
        ),
    ]);
}

#[test]
fn every_answer_is_read_with_any_blanks_and_number_forms() {
    answers(&[
        ("sidelength 40", "sidelength 40"),
        ("  sidelength\t0500 ", "sidelength 500"),
        ("karta 1 1 0 0", "karta 1 1 0 0"),
        ("karta 99 99\t99  99", "karta 99 99 99 99"),
        ("prodlis 0", "prodlis 0"),
        ("prodlist 0 ", "prodlist 0"),
        ("prodlist 1 0 0 0 left", "prodlist 1 0 0 0 left"),
        (
            "prodlis 02 2147483647 255 255 up\t1 0 0 right",
            "prodlis 2 2147483647 255 255 up 1 0 0 right",
        ),
        ("fetchprod 0", "fetchprod 0"),
        ("fetchprod 2147483647", "fetchprod 2147483647"),
        ("armcomm F1", "armcomm 11110001"),
        ("armcomm fa", "armcomm 11111010"),
        ("armcomm 0xF5", "armcomm 11110101"),
        ("armcomm 250", "armcomm 11111010"),
        ("armcomm 11111000", "armcomm 11111000"),
        ("styrcomm 1", "styrcomm 00000001"),
        ("styrcomm 0x9", "styrcomm 00001001"),
        ("styrcomm 00000100", "styrcomm 00000100"),
        (" pickup_done ", "pickup_done"),
    ]);
}

#[test]
fn the_strings_may_have_blanks_around_their_fields() {
    let map = read_map(" 4, 3 ,0,\t3 ").expect("a map");
    assert_eq!(Ok(map), read_map("4,3,0,3"));
    for (string, written) in [
        ("", ""),
        (" ; ", ""),
        ("7,1,0,3", "7,1,0,3"),
        (" 7 , 1 ,0, 3 ; ", "7,1,0,3"),
        (
            "röda skruvar,0,0,1;12,255,254,0",
            "röda skruvar,0,0,1;12,255,254,0",
        ),
        ("007,0,0,1", "007,0,0,1"),
    ] {
        let goods = Goods::read(string).expect(string);
        assert_eq!(goods.to_string(), written, "{string:?}");
    }
}

#[test]
fn an_answer_is_to_the_question_of_its_word() {
    let lines = [
        ("sidelength 40", Query::SideLength),
        ("karta 1 1 0 0", Query::Map),
        ("fetchprod 1", Query::Fetch),
        ("armcomm F1", Query::Arm),
        ("styrcomm 1", Query::Wheels),
        ("pickup_done", Query::Arm),
    ];
    for (line, to) in lines {
        let answer = Answer::read(line).expect(line);
        for query in Query::ALL {
            assert_eq!(answer.is_to(query), query == to, "{line} to {query}");
        }
    }
    for line in ["prodlis 0", "prodlist 0"] {
        let answer = Answer::read(line).expect(line);
        for query in Query::ALL {
            let is_list = matches!(query, Query::Products(_));
            assert_eq!(answer.is_to(query), is_list, "{line} to {query}");
        }
    }
}

#[test]
fn one_question_is_held_and_either_kind_of_command_answers_a_person_s() {
    let answer = |line| Answer::read(line).expect(line);
    let mut held = Held::default();
    assert_eq!(
        held.answer(&answer("karta 1 1 0 0")),
        Err(AnswerRefused::NothingHeld)
    );

    for (query, other) in [(Query::Wheels, "armcomm F3"), (Query::Arm, "styrcomm 2")] {
        held.ask(query);
        assert_eq!(held.answer(&answer(other)), Ok(query));
        assert_eq!(held.get(), None);
    }

    held.ask(Query::Arm);
    assert_eq!(held.answer(&answer("pickup_done")), Ok(Query::Arm));
    held.ask(Query::Wheels);
    let refused = AnswerRefused::Other {
        held: Query::Wheels,
    };
    assert_eq!(held.answer(&answer("pickup_done")), Err(refused));
    assert_eq!(held.get(), Some(Query::Wheels), "the question stays");
    assert_eq!(
        refused.to_string(),
        "`styrcomm` is asked, and this does not answer it"
    );
}

#[test]
fn a_new_question_takes_the_place_of_the_one_before() {
    let mut held = Held::default();
    held.ask(Query::Fetch);
    held.ask(Query::Wheels);
    let late = Answer::read("fetchprod 7").expect("an answer");
    assert_eq!(
        held.answer(&late),
        Err(AnswerRefused::Other {
            held: Query::Wheels
        })
    );
    held.clear();
    assert_eq!(held.answer(&late), Err(AnswerRefused::NothingHeld));
}

#[test]
fn what_follows_stop_never_keeps_it_from_being_one() {
    for (line, number) in [
        ("stop", None),
        ("  stop  ", None),
        ("stop 0", Some(0)),
        ("stop 4294967295", Some(u32::MAX)),
        ("stop 4294967296", None),
        ("stop -1", None),
        ("stop now", None),
        ("stop 5 and more", Some(5)),
    ] {
        assert_eq!(
            Order::read(line),
            Some(Ok(Order::Stop { number })),
            "{line:?}"
        );
    }
    assert_eq!(Order::read("stopped 1 2"), None);
}
