/* The handler of "buffer empty" returns without writing: it comes again as long as that holds.
   The handler of "received" reads one byte of two: it comes again for the other. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#define LOG ((volatile uint8_t *)0x3F00)

ISR(USART0_UDRE_vect) {
    if (++LOG[0] == 5) UCSR0B &= ~_BV(UDRIE0);
}

ISR(USART0_RX_vect) { LOG[1 + ++LOG[1]] = UDR0; }

int main(void) {
    LOG[0] = LOG[1] = 0;
    UBRR0 = 1;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    _delay_ms(1);
    UCSR0B |= _BV(UDRIE0) | _BV(RXCIE0);
    sei();
    for (;;) {}
}
