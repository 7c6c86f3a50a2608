import { Heading } from '../view/shell';
export default function Page() { return <Heading title="Blades">Blades</Heading>; }
