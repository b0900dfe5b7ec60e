//! [`Room`]: which clients are in, and which one must leave when another comes. It does no I/O.

use std::collections::BTreeMap;
use std::net::IpAddr;

use crate::{Visitor, known};

/// The places behind a door. Dropping a place's `T` tells its client to leave.
#[derive(Debug)]
pub(crate) struct Room<T> {
    most: usize,
    guests: BTreeMap<u64, Taken<T>>,
    next: u64,
}

#[derive(Debug)]
struct Taken<T> {
    from: IpAddr,
    visitor: Visitor,
    _leaves: T,
}

impl<T> Room<T> {
    pub(crate) fn new(most: usize) -> Self {
        Self {
            most,
            guests: BTreeMap::new(),
            next: 0,
        }
    }

    /// One more client comes, in the place of another if all are taken. `None` if all may stay. The
    /// client that must leave notices that its `leaves` is dropped.
    pub(crate) fn comes(&mut self, from: IpAddr, visitor: Visitor, leaves: T) -> Option<u64> {
        if self.guests.len() >= self.most {
            let goes = self.first_to_go()?;
            self.guests.remove(&goes);
        }
        let number = self.next;
        self.next += 1;
        let taken = Taken {
            from,
            visitor,
            _leaves: leaves,
        };
        self.guests.insert(number, taken);
        Some(number)
    }

    /// A client has left.
    pub(crate) fn goes(&mut self, number: u64) {
        self.guests.remove(&number);
    }

    /// The client that must leave: of those not admitted, or else of those that may not stay, the
    /// first one at the address that has most of them.
    fn first_to_go(&self) -> Option<u64> {
        self.first_below(known::ADMITTED)
            .or_else(|| self.first_below(known::STAYS))
    }

    fn first_below(&self, known: u8) -> Option<u64> {
        let below = || {
            let guests = self.guests.iter();
            guests.filter(|(_, guest)| guest.visitor.known() < known)
        };
        let count = |from: IpAddr| below().filter(|(_, guest)| guest.from == from).count();
        let most = below().map(|(_, guest)| guest.from);
        let most = most.max_by_key(|from| count(*from))?;
        let mut at_most = below().filter(|(_, guest)| guest.from == most);
        at_most.next().map(|(&number, _)| number)
    }
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use super::*;

    /// A client comes; returns whether each of those before it is still in.
    fn is_in<T>(room: &Room<T>, number: u64) -> bool {
        room.guests.contains_key(&number)
    }

    #[test]
    fn a_crowd_of_one_address_keeps_out_itself_alone() {
        let [crowd, other] = [[10, 0, 0, 1], [10, 0, 0, 2]].map(IpAddr::from);
        let mut room = Room::new(8);
        let visitor = Visitor::default();
        let one = room.comes(other, visitor, ()).expect("room");
        for _ in 0..1000 {
            room.comes(crowd, Visitor::default(), ()).expect("room");
        }
        assert!(is_in(&room, one));
        assert_eq!(room.guests.len(), 8);
    }

    #[test]
    fn who_says_nothing_goes_before_who_has_been_admitted_and_who_stays_does_not_go() {
        let here = IpAddr::from([127, 0, 0, 1]);
        let mut room = Room::new(3);
        let [stays, admitted, asked] = [(); 3].map(|()| Visitor::default());
        stays.let_stay();
        admitted.admit();
        asked.has_asked();
        let numbers = [stays, admitted, asked].map(|one| room.comes(here, one, ()).expect("room"));
        let next = Visitor::default();
        next.let_stay();
        room.comes(here, next, ())
            .expect("in place of one that has only asked");
        assert_eq!(numbers.map(|one| is_in(&room, one)), [true, true, false]);
        let last = Visitor::default();
        last.let_stay();
        room.comes(here, last, ())
            .expect("in place of the admitted one");
        assert_eq!(numbers.map(|one| is_in(&room, one)), [true, false, false]);
        assert_eq!(room.comes(here, Visitor::default(), ()), None, "all stay");
    }

    #[test]
    fn who_has_to_go_is_told() {
        let here = IpAddr::from([127, 0, 0, 1]);
        let mut room = Room::new(1);
        let told = Rc::new(());
        room.comes(here, Visitor::default(), Rc::clone(&told));
        assert_eq!(Rc::strong_count(&told), 2);
        room.comes(here, Visitor::default(), Rc::new(()));
        assert_eq!(Rc::strong_count(&told), 1);
        room.goes(1);
        assert!(room.guests.is_empty());
    }
}
