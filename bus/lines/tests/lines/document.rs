//! The examples and tables of the technical documentation, word by word (3.3.1 to 3.3.4, 3.3.7).

use lager_floor::{Heading, Node, Product, ProductId, SideLength};
use lager_lines::gag::{Answer, ListWord, Query, Request, Telemetry};
use lager_lines::strings::{Goods, map_string, read_map};
use lager_lines::{Products, Text, to_line};
use lager_wire::{ArmCommand, OperatorArm, OperatorCommand, Speed};

/// 3.3.7, "Styrkommando": number, value, what it does. The labels of 3 and 5 are exchanged there
/// (AMB-1); the list of 3.3.1 has them as here.
const WHEELS: [(&str, &str, OperatorCommand); 9] = [
    ("1", "00000001", OperatorCommand::Stop),
    ("2", "00000010", OperatorCommand::Forward(Speed::Full)),
    ("3", "00000011", OperatorCommand::FollowForward),
    ("4", "00000100", OperatorCommand::Backward(Speed::Full)),
    ("5", "00000101", OperatorCommand::FollowBackward),
    ("6", "00000110", OperatorCommand::Left(Speed::Full)),
    ("7", "00000111", OperatorCommand::Right(Speed::Full)),
    ("8", "00001000", OperatorCommand::LeftDiag),
    ("9", "00001001", OperatorCommand::RightDiag),
];

/// 3.3.7, "Armkommandon": number, value, what it does.
const ARM: [(&str, &str, ArmCommand); 10] = [
    ("F1", "11110001", ArmCommand::Clockwise),
    ("F2", "11110010", ArmCommand::CounterClockwise),
    ("F3", "11110011", ArmCommand::In),
    ("F4", "11110100", ArmCommand::Out),
    ("F5", "11110101", ArmCommand::Up),
    ("F6", "11110110", ArmCommand::Down),
    ("F7", "11110111", ArmCommand::Left),
    ("F8", "11111000", ArmCommand::Right),
    ("F9", "11111001", ArmCommand::Squeeze),
    ("FA", "11111010", ArmCommand::Release),
];

fn coord(x: u8, y: u8) -> Node {
    Node { x, y }
}

fn product(id: i32, x: u8, y: u8, side: Heading) -> Product {
    Product {
        id: ProductId::new(id).expect("a number"),
        square: coord(x, y),
        side,
    }
}

/// The question that a line asks, and the answer that another one gives to it.
fn exchange(asked: &str, answered: &str) -> (Query, Answer) {
    let Ok(Request::Query(query)) = Request::read(asked) else {
        panic!("{asked} asks nothing");
    };
    let answer = Answer::read(answered).expect("an answer");
    assert!(answer.is_to(query), "{answered} is no answer to {asked}");
    (query, answer)
}

#[test]
fn karta_tells_size_and_delivery() {
    let (query, answer) = exchange("karta", "karta 4 3 0 3");
    let Answer::Map(map) = answer else {
        panic!("a map");
    };
    assert_eq!(query, Query::Map);
    assert_eq!((map.size(), map.delivery()), (coord(4, 3), coord(0, 3)));
}

#[test]
fn sidelength_tells_centimetres() {
    let side = SideLength::new(40).expect("a side");
    let expected = (Query::SideLength, Answer::SideLength(side));
    assert_eq!(exchange("sidelength", "sidelength 40"), expected);
}

#[test]
fn prodlis_lists_stations() {
    let products = Products::new(vec![
        product(7, 1, 0, Heading::Down),
        product(12, 0, 1, Heading::Left),
    ])
    .expect("products");
    for (word, name) in [
        (ListWord::Prodlis, "prodlis"),
        (ListWord::Prodlist, "prodlist"),
    ] {
        let line = format!("{name} 2 7 1 0 down 12 0 1 left");
        let answer = Answer::Products(word, products.clone());
        assert_eq!(exchange(name, &line), (Query::Products(word), answer));
    }
}

#[test]
fn the_list_of_products_is_answered_in_the_spelling_that_asked() {
    for (asked, other) in [("prodlis", "prodlist"), ("prodlist", "prodlis")] {
        let (query, answer) = exchange(asked, &format!("{other} 1 7 1 0 up"));
        let line = to_line(&answer.spelled_as(query)).expect("a line");
        assert_eq!(line, format!("{asked} 1 7 1 0 up\n"));
    }
}

#[test]
fn there_may_be_no_products() {
    let none = Answer::Products(ListWord::Prodlis, Products::default());
    assert_eq!(exchange("prodlis", "prodlis 0").1, none);
    assert_eq!(none.to_string(), "prodlis 0");
}

#[test]
fn fetchprod_names_a_product() {
    let product = ProductId::new(12).expect("a number");
    let expected = (Query::Fetch, Answer::Fetch(product));
    assert_eq!(exchange("fetchprod", "fetchprod 12"), expected);
}

#[test]
fn armcomm_has_the_ten_steps_of_its_table() {
    for (number, value, step) in ARM {
        let step = OperatorArm::new(step).expect("an operator's step");
        let command = Answer::Command(OperatorCommand::Arm(step));
        for text in [number, value] {
            let (query, answer) = exchange("armcomm", &format!("armcomm {text}"));
            assert_eq!((query, &answer), (Query::Arm, &command));
        }
        // 3.3.2: "Formatet på dessa kommandon fungerar som ovan 1111----".
        assert_eq!(command.to_string(), format!("armcomm {value}"));
    }
}

#[test]
fn styrcomm_has_the_nine_commands_of_its_table() {
    for (number, value, command) in WHEELS {
        let command = Answer::Command(command);
        for text in [number, value] {
            let (query, answer) = exchange("styrcomm", &format!("styrcomm {text}"));
            assert_eq!((query, &answer), (Query::Wheels, &command));
        }
        // 3.3.1: "Alla kommandon representeras av 8 karaktärer anting 1:or eller 0:or".
        assert_eq!(command.to_string(), format!("styrcomm {value}"));
    }
}

#[test]
fn telemetry_is_not_answered() {
    let text = |text: &str| Text::new(text).expect("a text");
    for (line, telemetry) in [
        ("thought any string", Telemetry::Thought(text("any string"))),
        ("set_robot 2 1", Telemetry::Robot(coord(2, 1))),
        ("set_heading left", Telemetry::Heading(Heading::Left)),
        ("set_heading up", Telemetry::Heading(Heading::Up)),
        ("set_heading right", Telemetry::Heading(Heading::Right)),
        ("set_heading down", Telemetry::Heading(Heading::Down)),
    ] {
        assert_eq!(Request::read(line), Ok(Request::Telemetry(telemetry)));
    }
}

#[test]
fn the_map_string_has_the_delivery_in_one_of_four_corners() {
    // 3.3.3: (0, 0), (0, Y), (X, 0) and (X, Y) of "X,Y,x,y".
    for (string, delivery) in [
        ("5,4,0,0", coord(0, 0)),
        ("5,4,0,4", coord(0, 4)),
        ("5,4,5,0", coord(5, 0)),
        ("5,4,5,4", coord(5, 4)),
    ] {
        let map = read_map(string).expect("a map");
        assert_eq!((map.size(), map.delivery()), (coord(5, 4), delivery));
        assert_eq!(map_string(map), string);
    }
}

#[test]
fn the_goods_string_numbers_sides_clockwise_from_the_left() {
    // 3.3.4: "v1,x1,y1,s1;v2,x2,y2,s2;...", 0 is the left side and 3 the lower one.
    let goods = Goods::read("1,0,0,0;2,1,0,1;3,0,1,2;4,1,1,3;").expect("goods");
    let products = goods.products().expect("numbers");
    let expected = [
        product(1, 0, 0, Heading::Left),
        product(2, 1, 0, Heading::Up),
        product(3, 0, 1, Heading::Right),
        product(4, 1, 1, Heading::Down),
    ];
    assert_eq!(products.as_slice(), expected);
    assert_eq!(Goods::from(&products), goods);
    assert_eq!(goods.to_string(), "1,0,0,0;2,1,0,1;3,0,1,2;4,1,1,3");
    // "varonumret/namnet"
    let named = Goods::read("v1,0,0,0;v2,1,0,1;").expect("goods");
    assert_eq!(named.0[1].label(), "v2");
}
