use super::*;

const A: Owner = Owner(0);
const B: Owner = Owner(1);

fn keep_everything(_: Option<Shortage>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[tokio::test]
async fn small_reservations_pass_large_ones_that_wait() {
    let budget = Budget::new(1 << 20, 1);
    let most = budget.reserve(A, 700 << 10, keep_everything).await.unwrap().unwrap();
    let mut large = Box::pin(budget.reserve(A, 600 << 10, keep_everything));
    assert!(futures_util::poll!(&mut large).is_pending());
    let small = budget.reserve(A, 4 << 10, keep_everything).await.unwrap().unwrap();
    drop(most);
    assert_eq!(large.await.unwrap().unwrap().n_bytes(), 600 << 10);
    drop(small);
    assert_eq!(budget.n_held(), 0);
}

#[tokio::test]
async fn large_reservations_are_not_passed_by_large_ones_that_come_later() {
    let budget = Budget::new(1 << 20, 1);
    let first = budget.reserve(A, 500 << 10, keep_everything).await.unwrap().unwrap();
    let mut second = Box::pin(budget.reserve(A, 800 << 10, keep_everything));
    let mut third = Box::pin(budget.reserve(A, 100 << 10, keep_everything));
    assert!(futures_util::poll!(&mut second).is_pending() && futures_util::poll!(&mut third).is_pending());
    drop(second);
    assert!(third.await.is_ok());
    drop(first);
}

#[tokio::test]
async fn no_owner_holds_more_than_half_and_the_poorer_comes_first() {
    let budget = Budget::new(1 << 20, 2);
    assert_eq!(
        budget.reserve(A, 600 << 10, keep_everything).await.err(),
        Some(BeyondBudget { limit: 512 << 10 })
    );
    let of_a = budget.reserve(A, 400 << 10, keep_everything).await.unwrap().unwrap();
    let mut more_of_a = Box::pin(budget.reserve(A, 200 << 10, keep_everything));
    assert!(futures_util::poll!(&mut more_of_a).is_pending());
    // Its owner may not have it, so it blocks nobody else.
    let of_b = budget.reserve(B, 400 << 10, keep_everything).await.unwrap().unwrap();
    assert!(budget.try_reserve(A, 200 << 10).is_none());
    drop(of_a);
    assert!(more_of_a.await.is_ok());
    drop(of_b);
}

#[tokio::test]
async fn room_is_made_before_anybody_waits() {
    let budget = Budget::new(1 << 20, 1);
    let cached = Mutex::new(vec![budget.try_reserve(A, 400 << 10), budget.try_reserve(A, 400 << 10)]);
    let make_room = |shortage: Option<Shortage>| {
        let shortage = shortage.unwrap();
        assert_eq!((shortage.of_owner, shortage.of_all > 0), (0, true));
        cached.lock().unwrap().pop();
        ControlFlow::Continue(())
    };
    let found = budget.reserve(A, 450 << 10, make_room).await.unwrap().unwrap();
    assert_eq!((found.n_bytes(), cached.lock().unwrap().len()), (450 << 10, 1));
}

#[tokio::test]
async fn who_does_not_want_them_any_more_gives_up_the_turn() {
    let budget = Budget::new(1 << 20, 1);
    let most = budget.try_reserve(A, 700 << 10).unwrap();
    let is_wanted = std::sync::atomic::AtomicBool::new(true);
    let look = |_: Option<Shortage>| {
        if is_wanted.load(std::sync::atomic::Ordering::Relaxed) {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let mut first = Box::pin(budget.reserve(A, 800 << 10, look));
    let mut second = Box::pin(budget.reserve(A, 100 << 10, keep_everything));
    assert!(futures_util::poll!(&mut first).is_pending() && futures_util::poll!(&mut second).is_pending());
    is_wanted.store(false, std::sync::atomic::Ordering::Relaxed);
    assert!(first.await.unwrap().is_none());
    assert!(second.await.unwrap().is_some());
    drop(most);
}

#[test]
fn parts_of_a_reservation_are_given_back_one_by_one() {
    let budget = Budget::new(1 << 20, 1);
    let mut whole = budget.try_reserve(A, 1000).unwrap();
    let part = whole.split(300);
    assert_eq!((whole.n_bytes(), part.n_bytes(), budget.n_held()), (700, 300, 1000));
    drop(part);
    whole.shrink_to(100);
    assert_eq!(budget.n_held(), 100);
    assert!(whole.try_grow(50) && !whole.try_grow(2 << 20));
    drop(whole);
    assert_eq!(budget.n_held(), 0);
}
